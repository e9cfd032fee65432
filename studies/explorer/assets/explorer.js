// The address is the state: a control edits it here, the server answers with figures or with words.
(function () {
  "use strict";
  const shared = window.velotyreShared, look = window.velotyreTheme;
  const COALESCE = 800; // ms: changes of one control within it are one step of undo
  const BESIDE = 100000; // bytes of a request that are not its files
  const SETTLE = 200; // ms without a change before the figures at one speed follow
  const page = { text: "", past: [], lastKey: "", lastTime: 0, redraws: 0, settling: 0, modes: "", waiting: new Set(), sent: false };
  const at = (id) => document.getElementById(id);
  const send = (id, data) => window.dash_clientside.set_props(id, { data: data });

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
    at("undo").disabled = !page.past.length;
    send("state", text);
    if (options.redraw) redraw();
  }
  function redraw() {
    page.redraws += 1;
    send("redraw", { n: page.redraws, text: page.text });
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
  const PARTS = ["along", "damping", "sensitivity", "motion"]; // answers that a change waits for
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
    page.charts = (page.charts || 0) + 1;
    send("charted", { n: page.charts, text: text });
  }
  const modelOf = (text) => joined(pairs(text).filter(([key]) => !["pin", "mode", "slow", "fast", "at"].includes(key) || (key === "at" && !/(^|&)[xy]=speed/.test(text))).sort());
  function chartAge() { // a chart of an earlier model is pale and says so
    if (!page.chart || at("chart-place").hidden) return;
    const old = modelOf(page.text) !== page.chart;
    at("chart-place").classList.toggle("stale", old);
    if (!at("chart-busy").textContent.startsWith("comp")) at("chart-busy").textContent = old ? "of an earlier model; draw it again" : "";
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
    if (one) return one.name + ": " + one.size + " bytes are more than the " + most.largest + " of a file here; use the commands in a terminal";
    if (4 * all > 3 * (Number(most.largestBody) - BESIDE)) return "the files together have " + all + " bytes, too many at once; drop them one by one, the model last";
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
  function copy(button) {
    const text = at(button.dataset.copy).textContent;
    navigator.clipboard.writeText(text).then(
      () => { const was = button.textContent; button.textContent = "Copied"; setTimeout(() => { button.textContent = was; }, 1500); },
      () => { const range = document.createRange(); range.selectNodeContents(at(button.dataset.copy)); const s = getSelection(); s.removeAllRanges(); s.addRange(range); }
    );
  }

  look.hear(function (now) {
    if (page.begun) send("theme", now);
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

  // ---- figures: the modes at once, the others one after the other, so that the first is seen first ----
  const FIRST = "modes", waiting = new Map();
  function drawn(name, figure) {
    window.Plotly.react(at(name).firstElementChild, figure.data, figure.layout, { displaylogo: false, displayModeBar: false, responsive: true });
    if (name !== "locus") tables[name] = figure.layout.meta;
    if (name === "modes") tables.locus = tables.modes;
    fillTable(name);
    if (name === "modes") fillTable("locus");
    came(name);
  }
  function later(name, figure) {
    if (!waiting.size) setTimeout(next, 0);
    waiting.set(name, figure); // in place of one that was not drawn yet
  }
  function next() {
    const [name, figure] = waiting.entries().next().value;
    waiting.delete(name);
    if (waiting.size) setTimeout(next, 0);
    drawn(name, figure);
  }

  function list(place, lines) {
    place.replaceChildren(...lines.map(function (line) { const item = document.createElement("li"); item.textContent = line; return item; }));
  }
  function labelled() { // the part of Dash that makes it is read late
    const files = document.querySelector("#upload input[type=file]");
    if (files) files.setAttribute("aria-label", "Load a bicycle, model or tyre");
    else setTimeout(labelled, 50);
  }
  function nothing() { return window.dash_clientside.no_update; }

  // ---- what Dash calls ----
  window.dash_clientside = Object.assign({}, window.dash_clientside, {
    velotyre: {
      begin: function (initial) {
        look.place(at("theme-place"));
        if (window.innerWidth <= 760) at("controls").open = false; // the figures come first on a phone
        page.begun = true;
        page.text = location.hash.length > 1 ? location.hash.slice(1) : initial || "";
        send("theme", look.now());
        busy(PARTS);
        at("undo").disabled = true;
        redraw();
        return page.text;
      },
      fill: function (form) {
        if (!form) return nothing();
        const focus = document.activeElement && document.activeElement.id;
        labelled();
        at("form-model").innerHTML = form.html.model;
        at("form-speeds").innerHTML = form.html.speeds;
        at("form-at").innerHTML = form.html.at;
        at("form-chart").innerHTML = form.html.chart;
        page.modes = "";
        if (page.lastShown) modes(page.lastShown);
        if (focus && at(focus) && document.activeElement !== at(focus)) at(focus).focus();
        return nothing();
      },
      told: function (shown) {
        if (!shown) return nothing();
        const message = at("message");
        if (shown.asked !== page.text) return nothing(); // an answer to an earlier question
        message.textContent = shown.message ? shown.message + (page.lastShown ? " (The figures show the last model that could be computed.)" : "") : "";
        at("figures").classList.toggle("stale", Boolean(shown.message));
        if (shown.message) { busy([]); return nothing(); }
        came("along");
        page.text = shown.address;
        if (location.hash.slice(1) !== shown.address) history.replaceState(null, "", "#" + shown.address);
        page.lastShown = shown;
        look.model(shown.address);
        at("what").textContent = shown.name;
        at("unpin").disabled = !pairs(page.text).some(([key]) => key === "pin");
        modes(shown);
        chartAge();
        list(at("notes"), shown.critical.concat(shown.notes));
        clearTimeout(page.settling);
        page.settling = setTimeout(function () {
          page.sent = true;
          page.settled = (page.settled || 0) + 1;
          send("settled", { n: page.settled, text: shown.address });
        }, SETTLE);
        return nothing();
      },
      charted: function (told) {
        if (!told) return nothing();
        at("draw-chart").disabled = false;
        at("chart-busy").textContent = "";
        at("chart-said").textContent = told.message || "";
        if (told.message) return nothing();
        page.chart = modelOf(told.address);
        at("chart-place").hidden = false;
        list(at("chart-notes"), told.notes);
        chartAge();
        window.dispatchEvent(new Event("resize")); // it was hidden until now
        return nothing();
      },
      moved: function (data) {
        came("motion");
        if (data && data.message) { at("motion-said").textContent = data.message; return nothing(); }
        if (data) shared.show({ views: at("motion-views"), table: at("table-motion"), said: at("motion-said"), button: at("play") }, data);
        if (data) at("motion-title").textContent = "Mode shape: " + data.mode.replaceAll("_", " ");
        return nothing();
      },
      loaded: function (dropped) {
        if (!dropped) return nothing();
        at("loaded").textContent = dropped.message ? "" : ["loaded " + dropped.name].concat(dropped.remarks).join("; ");
        at("message").textContent = "";
        if (dropped.message) at("message").textContent = dropped.message;
        else if (dropped.address !== page.text) change(dropped.address, { redraw: true });
        else adopt(dropped.address, { redraw: true, replace: true }); // a tyre to choose, or the one that was lacking
        return nothing();
      },
      draw: function (figure, name) {
        if (!figure) return nothing();
        if (name === FIRST) drawn(name, figure);
        else later(name, figure);
        return nothing();
      },
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
})();
