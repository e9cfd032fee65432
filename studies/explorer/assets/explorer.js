// The address is the state: a control edits it here, the server answers with figures or with words.
(function () {
  "use strict";
  const shared = window.velotyreShared, look = window.velotyreTheme, server = window.velotyreServer;
  const COALESCE = 800; // ms: changes of one control within it are one step of undo
  const BESIDE = 100000; // bytes of a request that are not its files
  const SETTLE = 200; // ms without a change before the figures at one speed follow
  const page = { text: "", past: [], lastKey: "", lastTime: 0, asked: 0, settling: 0, modes: "", waiting: new Set(), sent: false };
  const at = (id) => document.getElementById(id);
  const question = (text) => ({ n: (page.asked += 1), text: text, theme: look.now() });
  const ask = (store, text) => server.send(store, question(text));

  // ---- the address as pairs of key and value ----
  function pairs(text) {
    return text.split("&").filter(Boolean).map(function (pair) {
      const cut = pair.indexOf("=");
      const part = (raw) => { try { return decodeURIComponent(raw); } catch (error) { return raw; } };
      return cut < 0 ? [part(pair), null] : [part(pair.slice(0, cut)), part(pair.slice(cut + 1))];
    });
  }
  function joined(list) {
    return list.map(([key, value]) => (value === null ? encodeURIComponent(key) : encodeURIComponent(key) + "=" + encodeURIComponent(value))).join("&");
  }
  function edited(text, edit) {
    const gone = (key) => edit.remove.some((prefix) => key === prefix || key.startsWith(prefix + "."));
    const kept = pairs(text).filter(([key]) => !gone(key) && !(key in edit.set));
    return joined(kept.concat(Object.entries(edit.set)));
  }

  // ---- changes ----
  function change(text, options) {
    if (text === page.text) return;
    const now = Date.now();
    const same = options.key && options.key === page.lastKey && now - page.lastTime < COALESCE;
    if (!same) page.past.push(page.text);
    page.lastKey = options.key || "";
    page.lastTime = now;
    adopt(text, { redraw: options.redraw, replace: same });
  }
  function adopt(text, options) {
    page.text = text;
    const url = "#" + text;
    if (options.replace) history.replaceState(null, "", url);
    else if (location.hash !== url) history.pushState(null, "", url);
    busy(PARTS);
    page.sent = false;
    clearTimeout(page.settling); // what is at one speed waits for the end of a move: it would hold the next figure up,
    moved(); // and so would those that are not seen
    at("undo").disabled = !page.past.length;
    server.send("state", text);
    follow();
    if (options.redraw) redraw();
  }
  async function follow() { // one question at a time: while a slider moves, the last of its values is asked next
    page.again = Boolean(page.following);
    if (page.following) return;
    page.following = true;
    const text = page.text, answer = await server.ask("along", question(text));
    await page.read;
    page.following = false;
    if (page.again) follow();
    along(answer.message ? { shown: { asked: text, message: answer.message } } : answer);
    schedule();
  }
  async function redraw(after) {
    const mine = (page.forms = (page.forms || 0) + 1), forms = await server.ask("form", question(page.text));
    await after;
    if (mine === page.forms && !forms.message) form(forms);
  }
  function undo() {
    if (!page.past.length) return;
    page.lastKey = "";
    adopt(page.past.pop(), { redraw: true });
  }
  function pin() {
    const alone = joined(pairs(page.text).filter(([key]) => key !== "pin"));
    const list = pairs(page.text).concat([["pin", alone || "bicycle=benchmark"]]);
    change(joined(list), {});
  }
  function unpin() { change(joined(pairs(page.text).filter(([key]) => key !== "pin")), {}); }
  const PARTS = ["along", "damping", "sensitivity", "amplitude", "motion"]; // answers that a change waits for
  function busy(parts) {
    page.waiting = new Set(parts);
    at("busy").textContent = parts.length ? "computing …" : "";
    at("figures").setAttribute("aria-busy", String(parts.length > 0));
  }
  function came(part) {
    if (page.waiting.has(part) && (part === "along" || page.sent)) busy([...page.waiting].filter((one) => one !== part));
  }

  // ---- the stability chart, drawn on request ----
  function axes() {
    const put = {};
    for (const name of ["x", "y"]) {
      const chosen = at("chart-" + name);
      if (!chosen) return null;
      const low = at("chart-" + name + "-low").value, high = at("chart-" + name + "-high").value;
      put[name] = chosen.value + (low !== "" && high !== "" ? "=" + low + ":" + high + (at("chart-" + name + "-log").checked ? ":log" : "") : "");
    }
    return put;
  }
  function drawChart() {
    const put = axes();
    if (!put) return;
    const text = edited(page.text, { remove: ["x", "y"], set: put });
    if (text !== page.text) change(text, { key: "chart" });
    at("chart-busy").textContent = "computing the chart …";
    at("draw-chart").disabled = true;
    page.charted = text;
    ask("ask-chart", text);
  }
  const modelOf = (text) => joined(pairs(text).filter(([key]) => !["pin", "mode", "slow", "fast", "at"].includes(key) || (key === "at" && !/(^|&)[xy]=speed/.test(text))).sort());
  function chartAge() { // a chart of an earlier model is pale and says so
    if (!page.chart || at("chart-place").hidden) return;
    const old = modelOf(page.text) !== page.chart;
    at("chart-place").classList.toggle("stale", old);
    if (!at("chart-busy").textContent.startsWith("comp")) at("chart-busy").textContent = old ? "of an earlier model; redraw" : "";
  }

  function edit(control) {
    if (control.dataset.axis) {
      if (control.matches("select")) {
        const usual = control.selectedOptions[0].dataset;
        at(control.id + "-low").value = usual.low || "";
        at(control.id + "-high").value = usual.high || "";
      }
      return;
    }
    if (control.matches("select:not([data-key])")) {
      const chosen = control.selectedOptions[0].dataset.edit;
      if (control.id === "theme") return look.choose(control.value);
      if (chosen) change(edited(page.text, JSON.parse(chosen)), { redraw: true });
    } else if (control.matches("input[type=checkbox]")) {
      change(edited(page.text, JSON.parse(control.checked ? control.dataset.on : control.dataset.off)), { redraw: true });
    } else if (control.dataset.key) {
      const key = control.dataset.key, value = control.value;
      if (control.validity && control.validity.badInput) return;
      for (const twin of document.querySelectorAll("[data-key]")) {
        if (twin !== control && twin.dataset.key === key && value !== "") twin.value = value;
      }
      const put = value === "" ? {} : { [key]: value };
      if ((key === "slow" || key === "fast") && at("n-at")) {
        const inside = Math.min(Math.max(Number(at("n-at").value), Number(at("n-slow").value)), Number(at("n-fast").value));
        if (inside > 0) put.at = String(inside);
      }
      change(edited(page.text, { remove: [key], set: put }), { key: key, redraw: "redraw" in control.dataset });
    }
  }
  // Dash drops a file that is too large without a word, and the server a body: said here, before either.
  function tooLarge(files) {
    const most = at("message").dataset, one = files.find((file) => file.size > Number(most.largest));
    const all = files.reduce((sum, file) => sum + file.size, 0);
    if (one) return one.name + ": " + one.size + " bytes exceed the limit of " + most.largest + " bytes for a file; use the commands in a terminal";
    if (4 * all > 3 * (Number(most.largestBody) - BESIDE)) return "the files have " + all + " bytes together, too many at once; drop them one by one, the model last";
    return "";
  }
  for (const kind of ["drop", "change"]) {
    document.addEventListener(kind, function (event) {
      if (!event.target.closest || !event.target.closest("#upload")) return;
      const message = tooLarge([...((event.dataTransfer || event.target).files || [])]);
      if (!message) return;
      event.preventDefault();
      event.stopPropagation();
      at("loaded").textContent = "";
      at("message").textContent = message;
      if (kind === "change") event.target.value = "";
    }, true);
  }

  document.addEventListener("input", function (event) {
    if (event.target.matches("input[type=range][data-key], input[type=number][data-key]")) edit(event.target);
  });
  document.addEventListener("change", function (event) {
    const bar = event.target.closest(".field");
    if (event.target.matches("select, input[type=checkbox]")) edit(event.target);
    else if (bar && (bar.querySelector(".measured") || /^(slow|fast)$/.test(event.target.dataset.key))) redraw(); // scales move
  });
  document.addEventListener("click", function (event) {
    const button = event.target.closest("button");
    if (!button) return;
    if (button.id === "undo") undo();
    else if (button.id === "pin") pin();
    else if (button.id === "unpin") unpin();
    else if (button.id === "draw-chart") drawChart();
    else if (button.id === "play") shared.toggle();
    else if (button.dataset.image) shared.image(button.dataset.image, button.dataset.format, "velotyre_" + button.dataset.image);
    else if (button.dataset.copy) copy(button);
    else if (button.dataset.save) save(button.dataset.save);
  });
  document.addEventListener("keydown", function (event) {
    if (!event.altKey || event.ctrlKey) return;
    if (event.code === "KeyZ") { event.preventDefault(); undo(); }
    if (event.code === "KeyP") { event.preventDefault(); pin(); }
  });
  window.addEventListener("popstate", function () {
    const text = location.hash.slice(1);
    if (text !== page.text) { page.lastKey = ""; adopt(text, { redraw: true, replace: true }); }
  });
  function save(what) {
    const text = what === "chart" ? page.charted : page.lastShown && page.lastShown.asked;
    if (!text) return;
    const charted = what === "page" && page.chart && modelOf(text) === page.chart; // not one of an earlier model
    server.send("save", Object.assign(question(text), { what: charted ? "page with chart" : what }));
  }
  function copy(button) {
    const text = at(button.dataset.copy).textContent;
    navigator.clipboard.writeText(text).then(
      () => { const was = button.textContent; button.textContent = "Copied"; setTimeout(() => { button.textContent = was; }, 1500); },
      () => { const range = document.createRange(); range.selectNodeContents(at(button.dataset.copy)); const s = getSelection(); s.removeAllRanges(); s.addRange(range); }
    );
  }

  look.hear(function () {
    follow();
    if (page.charted) ask("ask-chart", page.charted);
  });

  // ---- tables, filled when they are opened ----
  const tables = {};
  function fillTable(name) {
    const details = document.querySelector('details[data-table="' + name + '"]');
    if (details && details.open && tables[name]) shared.table(at("table-" + name), tables[name], details.querySelector("summary").textContent.replace("Table: ", ""));
  }
  document.addEventListener("toggle", function (event) {
    const name = event.target.dataset && event.target.dataset.table;
    if (name && name !== "motion") fillTable(name);
  }, true);

  // ---- figures: the modes at once, then what is seen, one after the other; the rest when nothing changes ----
  const waiting = new Map();
  function drawn(name, figure) {
    window.Plotly.react(at(name).firstElementChild, figure.data, figure.layout, { displaylogo: false, displayModeBar: false, responsive: true });
    if (name !== "locus") tables[name] = figure.layout.meta;
    if (name === "modes") tables.locus = tables.modes;
    fillTable(name);
    if (name === "modes") fillTable("locus");
    came(name);
  }
  function later(name, figure) {
    waiting.set(name, figure); // in place of one that was not drawn yet
    moved();
  }
  function moved() {
    page.heard = performance.now();
    schedule();
  }
  function seen(name) {
    const place = at(name).getBoundingClientRect();
    return place.top < window.innerHeight && place.bottom > 0;
  }
  function schedule() {
    clearTimeout(page.drawing);
    if (!waiting.size) return;
    const quiet = Math.max(0, page.heard + SETTLE - performance.now());
    if ([...waiting.keys()].some(seen)) page.drawing = setTimeout(next, 0);
    else if (!page.following) page.drawing = setTimeout(next, quiet); // else when the answer has come
  }
  function next() {
    const name = [...waiting.keys()].find(seen) || waiting.keys().next().value, figure = waiting.get(name);
    waiting.delete(name);
    schedule();
    drawn(name, figure);
  }
  window.addEventListener("beforeprint", function () { while (waiting.size) next(); });

  function list(place, lines) {
    place.replaceChildren(...lines.map(function (line) { const item = document.createElement("li"); item.textContent = line; return item; }));
  }
  function labelled() { // the part of Dash that makes it is read late
    const files = document.querySelector("#upload input[type=file]");
    if (files) files.setAttribute("aria-label", "Load a bicycle, model or tyre");
    else setTimeout(labelled, 50);
  }
  // ---- what the server answers, by the name of its store ----
  function along(answer) {
    const figures = answer.figures;
    if (figures) drawn("modes", figures.modes);
    told(answer.shown);
    if (!figures) return;
    later("critical", figures.critical);
    later("locus", figures.locus);
  }
  function explain(shown) { // what a number means on this bicycle, such as the height of a hinge above the hub
    for (const one of document.querySelectorAll("[data-beside]")) one.textContent = shown.beside[one.dataset.beside] || "";
  }
  function told(shown) {
    const message = at("message");
    if (shown.asked !== page.text) return; // an answer to an earlier question
    for (const one of document.querySelectorAll(".field > .said[role=alert]")) one.textContent = "";
    const beside = shown.key && at("said-" + shown.key); // the slider that was moved too far
    if (beside) beside.textContent = shown.message;
    message.textContent = beside ? "" : shown.message ? shown.message + (page.lastShown ? " (The figures show the last model that could be computed.)" : "") : "";
    at("figures").classList.toggle("stale", Boolean(shown.message));
    if (shown.message) { busy([]); return; }
    came("along");
    page.text = shown.address;
    if (location.hash.slice(1) !== shown.address) history.replaceState(null, "", "#" + shown.address);
    page.lastShown = shown;
    at("sides").innerHTML = shown.sides;
    explain(shown);
    at("what").textContent = shown.name;
    at("unpin").disabled = !pairs(page.text).some(([key]) => key === "pin");
    modes(shown);
    chartAge();
    list(at("notes"), shown.critical.concat(shown.notes));
    clearTimeout(page.settling);
    page.settling = setTimeout(function () {
      page.sent = true;
      ask("ask-at", shown.address);
      ask("ask-motion", shown.address);
    }, SETTLE);
  }
  function damping(answer) {
    at("text-command").textContent = answer.command;
    at("text-python").textContent = answer.python;
    later("damping", answer.figure);
  }
  function motion(data) {
    came("motion");
    if (data.message) { at("motion-said").textContent = data.message; return; }
    shared.show({ views: at("motion-views"), table: at("table-motion"), said: at("motion-said"), button: at("play") }, data);
    at("motion-title").textContent = "Mode shape: " + data.mode.replaceAll("_", " ");
  }
  function form(forms) {
    const focus = document.activeElement && document.activeElement.id;
    at("form-model").innerHTML = forms.html.model;
    at("form-speeds").innerHTML = forms.html.speeds;
    at("form-at").innerHTML = forms.html.at;
    at("form-chart").innerHTML = forms.html.chart;
    page.modes = "";
    if (page.lastShown) { modes(page.lastShown); explain(page.lastShown); }
    if (focus && at(focus) && document.activeElement !== at(focus)) at(focus).focus();
  }
  function chart(answer) {
    at("draw-chart").disabled = false;
    at("chart-busy").textContent = "";
    at("chart-said").textContent = answer.message || "";
    if (answer.message) return;
    page.chart = modelOf(answer.address);
    at("chart-place").hidden = false;
    list(at("chart-notes"), answer.notes);
    chartAge();
    later("chart", answer.figure);
  }
  function dropped(files) {
    at("loaded").textContent = files.message ? "" : ["loaded " + files.name].concat(files.remarks).join("; ");
    at("message").textContent = "";
    if (files.message) at("message").textContent = files.message;
    else if (files.address !== page.text) change(files.address, { redraw: true });
    else adopt(files.address, { redraw: true, replace: true }); // a tyre to choose, or the one that was lacking
  }
  function sensitivity(answer) { later("sensitivity", answer.figure); }
  function amplitude(answer) { later("amplitude", answer.figure); }
  function carry() { server.carry(); labelled(); }
  const heard = (read) => function (answer) { if (answer) read(answer); };
  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    velotyre: {
      carry, damping: heard(damping), sensitivity: heard(sensitivity), amplitude: heard(amplitude), motion: heard(motion), chart: heard(chart),
      dropped: heard(dropped),
    },
  });

  function modes(shown) {
    const place = at("c-mode");
    if (!place) return;
    const chosen = (pairs(page.text).find(([key]) => key === "mode") || [])[1] || "";
    const known = JSON.stringify([shown.modes, chosen]);
    if (known === page.modes) return;
    page.modes = known;
    place.replaceChildren(...shown.modes.map(function (mode) {
      const option = document.createElement("option");
      option.value = mode.value;
      option.textContent = mode.words;
      option.dataset.edit = JSON.stringify({ remove: [], set: { mode: mode.value } });
      option.selected = mode.value === chosen;
      return option;
    }));
  }

  // ---- the beginning: figures and forms are asked for while the browser reads what draws, Dash comes after them ----
  async function begin() {
    look.place(at("theme-place"));
    if (window.innerWidth <= 760) at("controls").open = false; // the figures come first on a phone
    page.text = location.hash.length > 1 ? location.hash.slice(1) : at("page").dataset.initial;
    page.read = new Promise((done) => document.addEventListener("DOMContentLoaded", done)); // with plotly, the last program
    server.send("state", page.text);
    busy(PARTS);
    at("undo").disabled = true;
    const figures = follow();
    redraw(figures);
    try { await figures; } finally { server.callDash(); }
  }
  begin();
})();
