// The page of recordings: files go to the server, a computation is asked for and watched, what it found is shown.
(function () {
  "use strict";
  const shared = window.velotyreShared, look = window.velotyreTheme;
  const at = (id) => document.getElementById(id);
  const given = (key) => JSON.parse(document.body.dataset[key]);
  const KINDS = { look: "Look", fit: "Fit", tyre_fit: "Fit of the tyre", diagnosis: "Diagnosis" };
  const POLL = 300; // ms
  const NOT_RECORDINGS = /\.(toml|ya?ml|dbc|json|md|html)$/i;
  const page = { desk: "", files: [], speeds: {}, running: "", shown: {}, drawn: [] };

  // ---- the server ----
  async function ask(path, options) {
    let answer;
    try { answer = await fetch("/recording/" + path, options); }
    catch (error) { throw new Error("velotyre explore does not answer; is it still running?"); }
    if (!answer.ok) { const failed = new Error((await answer.text()).trim()); failed.code = answer.status; throw failed; }
    return answer.json();
  }
  const post = (path, body) => ask(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body || {}) });
  function token(value) {
    try { if (value !== undefined) sessionStorage.setItem("velotyre-desk", value); return sessionStorage.getItem("velotyre-desk") || ""; }
    catch (error) { return value || ""; }
  }
  async function desk() {
    if (!page.desk) { page.desk = (await post("open")).desk; token(page.desk); }
    return page.desk;
  }
  function message(words) { at("message").textContent = words || ""; if (words) at("message").scrollIntoView({ block: "nearest" }); }
  async function tried(work) {
    message("");
    at("other").hidden = true;
    try { await work(); }
    catch (error) { message(error.message); at("other").hidden = error.code !== 409; }
  }

  // ---- files ----
  async function load(list) {
    const problems = [], done = [];
    for (const file of list) {
      at("loaded").textContent = "loading " + file.name + " …";
      if (file.size > Number(document.body.dataset.largest)) {
        problems.push(file.name + ": " + file.size + " bytes are more than the " + document.body.dataset.largest + " that a file may have here; use the commands in a terminal");
        continue;
      }
      try {
        const path = (file.webkitRelativePath || file.name).split("/").map(encodeURIComponent).join("/");
        files((await ask((await desk()) + "/file/" + path, { method: "POST", body: file })).files);
        done.push(file.name);
      } catch (error) { problems.push(error.message); }
    }
    at("loaded").textContent = done.length ? "loaded " + done.join(", ") : "";
    message(problems.join("\n"));
  }
  function files(list) {
    page.files = list;
    at("file-table").hidden = !list.length;
    at("file-rows").replaceChildren(...list.map(function (file) {
      const row = document.createElement("tr");
      const speed = document.createElement("input");
      Object.assign(speed, { type: "number", min: "0", step: "any", value: page.speeds[file.name] || "" });
      speed.setAttribute("aria-label", "Speed of " + file.name + ", m/s");
      speed.addEventListener("input", () => { page.speeds[file.name] = speed.value; });
      const remove = button("Remove", () => tried(async () => files((await post(page.desk + "/remove", { name: file.name })).files)));
      remove.setAttribute("aria-label", "Remove " + file.name);
      const name = document.createElement("td");
      if (file.made) link(name, page.desk + "/out/" + file.name.split("/").map(encodeURIComponent).join("/"), file.name);
      else name.textContent = file.name;
      row.append(name, cell(String(file.bytes)), cell(NOT_RECORDINGS.test(file.name) ? "" : speed), cell(remove));
      return row;
    }));
    choices();
  }
  function choices() {
    const names = page.files.map((file) => file.name), tomls = names.filter((name) => /\.toml$/i.test(name));
    const drafts = ((page.shown.look || {}).files || []).map((file) => "look/" + file.name).filter((name) => /\.(channels|decays)\.toml$/.test(name));
    fill(at("recording"), names.filter((name) => !NOT_RECORDINGS.test(name)).map((name) => [name, name]), "load a recording first");
    const folders = [...new Set(names.filter((name) => name.includes("/")).map((name) => name.slice(0, name.lastIndexOf("/"))))].sort();
    fill(at("folder"), [["", names.length ? "all that are loaded" : "load recordings first"]].concat(folders.map((name) => [name, "in " + name])));
    const map = document.body.dataset.map;
    const maps = [["", "as the sidecar says, else as guessed"]].concat(
      names.includes(map) ? [[map, "as in the table of this page"]] : [],
      drafts.map((name) => [name, "draft " + name.slice(5) + (name.includes(".decays.") ? " (with windows)" : "")]),
      tomls.filter((name) => name !== map).map((name) => [name, name]));
    for (const select of document.querySelectorAll(".maps")) fill(select, maps);
    fill(at("measurement"), tomls.filter((name) => name !== map).map((name) => [name, name]).concat(given("measurements").map((name) => [name, name + " (packaged)"])));
  }
  function fill(select, options, empty) {
    const was = select.value;
    if (!options.length && empty) options = [["", empty]];
    select.replaceChildren(...options.map(function ([value, words]) { const one = document.createElement("option"); one.value = value; one.textContent = words; return one; }));
    if (options.some(([value]) => value === was)) select.value = was;
  }
  function cell(content) { const made = document.createElement("td"); made.append(content); return made; }
  function button(words, act) { const made = document.createElement("button"); made.textContent = words; made.addEventListener("click", act); return made; }

  // ---- computations ----
  async function run(kind, asked) {
    await post((await desk()) + "/run", Object.assign({ kind: kind }, asked));
    at("result-" + kind).replaceChildren();
    if (kind === "look") at("describe").replaceChildren();
    watch(kind);
  }
  function busy(kind) {
    page.running = kind;
    at("job").hidden = !kind;
    for (const one of document.querySelectorAll(".run")) one.disabled = Boolean(kind);
    for (const one of Object.keys(KINDS)) at("result-" + one).setAttribute("aria-busy", String(one === kind));
  }
  async function watch(kind) {
    busy(kind);
    for (;;) {
      let job;
      try { job = (await ask(page.desk + "/state")).job; }
      catch (error) { busy(""); message(error.message); return; }
      if (!job) { busy(""); return; }
      if (job.state !== "running") { busy(""); ended(job); return; }
      at("job-words").textContent = KINDS[kind] + ": " + (job.words || "begins") + ", " + Math.round(job.seconds) + " s";
      await new Promise((done) => setTimeout(done, POLL));
    }
  }
  function ended(job) {
    if (job.state === "done") tried(() => fetched(job.kind, true));
    else message(job.state === "cancelled" ? KINDS[job.kind] + " was cancelled; nothing is kept of it." : job.message);
  }
  async function fetched(kind, first) {
    const found = await ask(page.desk + "/result/" + kind);
    page.shown[kind] = found;
    show(kind, found);
    choices();
    if (kind === "look") { channels(found); describe(found.drafts); }
    if (first) at("result-" + kind).querySelector(".verdict").focus();
  }

  // ---- what was found ----
  function add(place, tag, words, name) {
    const made = document.createElement(tag);
    if (words) made.textContent = words;
    if (name) made.className = name;
    place.appendChild(made);
    return made;
  }
  function list(place, lines) {
    if (lines.length) { const made = add(place, "ul"); for (const line of lines) add(made, "li", line); }
  }
  function folded(place, words, content) {
    const made = add(place, "details");
    add(made, "summary", words);
    made.appendChild(content);
    return made;
  }
  function tableOf(words, content) {
    const made = document.createElement("div");
    made.className = "table";
    made.tabIndex = 0;
    shared.table(made, content, words + (content.note ? " (" + content.note + ")" : ""));
    return made;
  }
  function show(kind, found) {
    const place = at("result-" + kind);
    place.replaceChildren();
    const verdict = add(place, "p", found.odd_part || found.sentence, "verdict");
    verdict.tabIndex = -1;
    if (found.odd_part) add(place, "p", "All parts together: " + found.sentence);
    if (found.means) add(place, "p", found.means);
    list(place, found.closing || []);
    if (found.uses) uses(place, found);
    const tables = () => { for (const one of found.tables || []) folded(place, one.words, tableOf(one.words, one)).open = kind === "fit" || one.words.startsWith("Fitted"); };
    if (kind === "tyre_fit") tables();
    const figures = add(place, "div", "", "figures");
    for (const figure of found.figures) draw(kind, figures, figure);
    for (const image of found.images || []) {
      const frame = add(figures, "figure");
      const made = add(frame, "img");
      Object.assign(made, { src: "/recording/" + page.desk + "/out/" + kind + "/" + image.file, alt: image.words });
      add(frame, "figcaption", image.words);
    }
    if (found.further && found.further.length) { add(place, "h3", "What to measure next"); add(place, "p", found.further_note); list(place, found.further); }
    if (kind !== "tyre_fit") tables();
    const printed = document.createElement("pre");
    printed.textContent = [found.printed].concat(found.notes).join("\n");
    printed.tabIndex = 0;
    folded(place, "As the command prints it", printed);
    add(place, "h3", "Files");
    const down = add(place, "div", "", "bar files");
    link(down, page.desk + "/zip/" + kind, "all as a zip");
    for (const file of found.files.filter((one) => !one.name.startsWith("cache/"))) link(down, page.desk + "/out/" + kind + "/" + file.name.split("/").map(encodeURIComponent).join("/"), file.name);
    const mounts = (found.tyres || []).length ? add(place, "div", "", "bar form") : place;
    for (const name of found.tyres || []) {
      mounts.appendChild(button("Put " + name.split("/").pop() + " on the bicycle of the model page", () => tried(async () => {
        location.href = "/#" + (await post(page.desk + "/mount", { name: name, model: look.model() || "" })).address;
      })));
    }
    if (kind === "fit" && found.files.some((file) => file.name === "modal.csv")) {
      add(place, "p", "A measurement file with kind = \"modal\" and table = \"modal.csv\" takes the roots further:", "about");
      place.appendChild(button("Keep modal.csv among the files above", () => tried(async () => { files((await post(page.desk + "/keep", { name: "fit/modal.csv" })).files); at("loaded").textContent = "kept modal.csv"; })));
    }
  }
  function describe(drafts) { // a rig recording without a sidecar: what no file can say
    at("describe").replaceChildren();
    for (const draft of drafts) {
      const form = add(at("describe"), "fieldset");
      add(form, "legend", "Describe it for a fit of the tyre: " + draft.file.slice(5));
      add(form, "p", "The look drafted a sidecar; only you know the rest. It is kept among the files above, for the fit.", "about");
      const row = add(form, "div", "", "bar form");
      for (const field of draft.fields) {
        const place = add(row, "div", "", "choice"), label = add(place, "label", field.key.replaceAll("_", " "));
        add(label, "span", field.words, "unit");
        const made = add(place, field.kind === "choice" || field.kind === "flag" ? "select" : "input");
        made.id = label.htmlFor = "describe-" + draft.file.replaceAll(/\W/g, "-") + "-" + field.key;
        if (field.kind === "choice") fill(made, [["", "choose"]].concat(field.options.map((one) => [one, one])));
        else if (field.kind === "flag") fill(made, [["true", "yes"], ["false", "no"]]);
        else Object.assign(made, field.kind === "number" ? { type: "number", step: "any", min: "0" } : { type: "text" });
        made.value = String(field.value);
      }
      row.appendChild(button("Keep as sidecar", () => tried(async () => {
        const body = { draft: draft.file };
        draft.fields.forEach(function (field, k) {
          const value = row.querySelectorAll("input, select")[k].value.trim();
          if (value !== "") body[field.key] = field.kind === "number" ? Number(value) : field.kind === "flag" ? value === "true" : value;
        });
        const answer = await post(page.desk + "/describe", body);
        files(answer.files);
        at("loaded").textContent = "kept " + answer.name;
        at("run-tyre_fit").focus();
      })));
    }
  }
  function link(place, path, words) {
    const made = add(place, "a", words);
    made.href = "/recording/" + path;
    made.download = words === "all as a zip" ? "" : words.split("/").pop();
  }
  function uses(place, found) {
    list(place, found.times.map((line) => "time: " + line).concat(Object.entries(found.unread).map(([name, why]) => name + " is left out: " + why)));
    for (const use of found.uses) {
      const inside = document.createElement("div");
      list(inside, use.said.concat(use.remedies.map((line) => "What to do: " + line)));
      folded(place, (use.usable ? "✓ " : "✗ ") + use.name + ": " + (use.usable ? "usable" + (use.provided ? ", once you give " + use.provided : "") : "no"), inside);
    }
  }
  function draw(kind, place, figure) {
    const frame = add(place, "figure"), graph = add(frame, "div");
    graph.id = kind + "-" + figure.name;
    frame.setAttribute("aria-label", figure.words);
    if (figure.note) add(frame, "figcaption", figure.note);
    const under = add(frame, "div", "", "under");
    folded(under, "Table: " + figure.words.toLowerCase(), tableOf(figure.words, figure.table));
    const images = add(under, "div", "", "images");
    for (const format of ["svg", "png"]) {
      const made = button(format.toUpperCase(), () => shared.image(graph.id, format, "velotyre_" + graph.id));
      made.setAttribute("aria-label", figure.words + " as " + format);
      images.appendChild(made);
    }
    plot(graph, figure);
    page.drawn.push([graph, figure]);
  }
  const narrow = window.matchMedia("(max-width: 760px)");
  function replot() {
    page.drawn = page.drawn.filter(([graph]) => graph.isConnected);
    for (const [graph, figure] of page.drawn) plot(graph, figure);
  }
  look.hear(replot);
  narrow.addEventListener("change", replot);
  function plot(graph, figure) {
    const width = narrow.matches ? "narrow" : "wide", layout = figure.layouts[look.now()][width];
    const own = (width === "narrow" && figure.narrow) || [];
    const data = figure.data.map((trace, k) => Object.assign({}, trace, figure.styles[look.now()][k], own[k]));
    graph.style.height = layout.height + "px";
    window.Plotly.react(graph, data, layout, { displaylogo: false, displayModeBar: false, responsive: true });
  }

  // ---- which column is what ----
  function channels(found) {
    const names = [["", "not used"]].concat(given("channels").map((name) => [name, name + ", " + given("units")[name]]));
    at("channels").hidden = false;
    at("channels-from").textContent = "Channels " + found.channels_from + ". Change what is wrong and look again; the fit can use it too.";
    at("channel-rows").replaceChildren(...found.channels.map(function (row) {
      const line = document.createElement("tr");
      line.dataset.column = row.name;
      const taken = document.createElement("select"), unit = document.createElement("input"), sign = document.createElement("select");
      fill(taken, names);
      taken.value = row.channel;
      taken.setAttribute("aria-label", row.name + " taken as");
      Object.assign(unit, { type: "text", value: row.map_unit, placeholder: row.unit || "", size: 6 });
      unit.setAttribute("aria-label", "Unit of " + row.name);
      fill(sign, [["1", "+"], ["-1", "−"]]);
      sign.value = String(row.sign);
      sign.setAttribute("aria-label", "Sign of " + row.name);
      const number = (value) => (value === null ? "–" : String(Number(value.toPrecision(5))));
      const head = add(line, "th", row.name);
      head.scope = "row";
      line.append(cell(row.unit || "–"), cell(row.samples + (row.missing ? " (" + row.missing + " missing)" : "")), cell(number(row.lowest)), cell(number(row.median)), cell(number(row.highest)), cell(taken), cell(unit), cell(sign), cell(row.remarks.join("; ")));
      return line;
    }));
  }
  async function useMap() {
    const rows = [];
    for (const line of at("channel-rows").rows) {
      const [taken, unit, sign] = line.querySelectorAll("select, input");
      if (taken.value) rows.push({ channel: taken.value, column: line.dataset.column, unit: unit.value.trim(), sign: Number(sign.value) });
    }
    if (at("rate").value) rows.push({ channel: "time", rate_hz: Number(at("rate").value) });
    const answer = await post(page.desk + "/map", { rows: rows });
    files(answer.files);
    for (const select of document.querySelectorAll(".maps")) select.value = answer.map;
    await run("look", { file: at("recording").value, map: answer.map });
  }

  // ---- what the user does ----
  const number = (id) => (at(id).value === "" ? {} : { [id]: Number(at(id).value) });
  at("files").addEventListener("change", () => { load([...at("files").files]).then(() => { at("files").value = ""; }); });
  for (const kind of ["dragover", "dragleave", "drop"]) {
    at("drop").addEventListener(kind, function (event) {
      event.preventDefault();
      at("drop").classList.toggle("over", kind === "dragover");
      if (kind === "drop") load([...event.dataTransfer.files]);
    });
  }
  at("run-look").addEventListener("click", () => tried(() => run("look", { file: at("recording").value, map: at("map").value })));
  at("use-map").addEventListener("click", () => tried(useMap));
  at("run-fit").addEventListener("click", () => tried(() => run("fit", Object.assign({
    runs: page.files.filter((file) => page.speeds[file.name]).map((file) => ({ file: file.name, speed: Number(page.speeds[file.name]) })),
    map: at("fit-map").value, modes: at("modes").value,
  }, number("from"), number("to")))));
  at("run-tyre_fit").addEventListener("click", () => tried(() => run("tyre_fit", Object.assign(
    { folder: at("folder").value, map: at("tyre-map").value },
    ...[...document.querySelectorAll(".tyre-option")].filter((one) => one.value !== "").map((one) => ({ [one.dataset.name]: Number(one.value) })),
  ))));
  at("run-diagnosis").addEventListener("click", () => tried(() => run("diagnosis", {
    measurement: at("measurement").value, variants: at("variants").checked,
    without: at("without").value.split(",").map((name) => name.trim()).filter(Boolean),
  })));
  at("cancel").addEventListener("click", () => tried(() => post("cancel")));
  at("stop-other").addEventListener("click", () => tried(() => post("cancel")));
  at("theme-place").addEventListener("change", (event) => look.choose(event.target.value));
  look.place(at("theme-place"));
  if (look.model()) at("to-model").href = "/#" + look.model();
  choices();

  async function begin() { // again after a reload: files and results are still on the server
    page.desk = token();
    if (!page.desk) return;
    let state;
    try { state = await ask(page.desk + "/state"); } catch (error) { page.desk = ""; token(""); return; }
    files(state.files);
    for (const kind of state.results) await fetched(kind, false);
    if (state.job && state.job.state === "running") watch(state.job.kind);
  }
  begin().then(() => { document.documentElement.dataset.ready = "yes"; });
})();
