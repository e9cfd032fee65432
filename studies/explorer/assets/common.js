// What the page and a saved page have in common: tables from numbers, and the motion of a mode as moving lines.
window.velotyreShared = (function () {
  "use strict";

  function cell(tag, value) {
    const made = document.createElement(tag);
    if (typeof value === "number") {
      made.textContent = String(Number(value.toPrecision(7)));
      made.dataset.value = String(value); // every digit
    } else {
      made.textContent = value === null || value === undefined ? "–" : value;
    }
    return made;
  }

  function table(place, content, caption) {
    const made = document.createElement("table");
    const title = made.createCaption();
    title.textContent = caption;
    const head = made.createTHead().insertRow();
    for (const name of content.columns) {
      const one = cell("th", name);
      one.scope = "col";
      head.appendChild(one);
    }
    const body = made.createTBody();
    for (const row of content.rows) {
      const line = body.insertRow();
      for (const value of row) line.appendChild(cell("td", value));
    }
    place.replaceChildren(made);
  }

  const SVG = "http://www.w3.org/2000/svg";
  const STILL = [0, 6, 12, 18]; // frames shown over each other where nothing may move
  const SHOWN_PERIOD = 2.0; // s; quicker and slower modes are shown in it
  const quiet = window.matchMedia("(prefers-reduced-motion: reduce)");
  const motion = { data: null, playing: !quiet.matches, began: 0, paths: [], frame: -1 };

  function show(places, data) {
    motion.data = data;
    motion.frame = -1;
    motion.places = places;
    motion.paths = [];
    places.views.replaceChildren();
    for (const view of data.views) {
      const box = document.createElement("div");
      const words = document.createElement("p");
      words.textContent = view.name;
      const svg = document.createElementNS(SVG, "svg");
      svg.setAttribute("viewBox", view.box);
      svg.setAttribute("role", "img");
      svg.setAttribute("aria-label", data.mode.replaceAll("_", " ") + " " + view.name);
      for (const ghost of STILL) {
        for (const [body, frames] of Object.entries(view.paths)) {
          const path = document.createElementNS(SVG, "path");
          path.setAttribute("d", frames[ghost % view.frames]);
          path.setAttribute("class", "body-" + body + " ghost");
          svg.appendChild(path);
        }
      }
      for (const [body, frames] of Object.entries(view.paths)) {
        const path = document.createElementNS(SVG, "path");
        path.setAttribute("class", "body-" + body);
        svg.appendChild(path);
        motion.paths.push([path, frames]);
      }
      box.append(words, svg);
      places.views.appendChild(box);
    }
    table(places.table, data.table, "Shape of " + data.mode.replaceAll("_", " "));
    said();
    draw(0);
  }

  function draw(frame) {
    if (frame === motion.frame) return;
    motion.frame = frame;
    for (const [path, frames] of motion.paths) path.setAttribute("d", frames[frame]);
  }

  function said() {
    const data = motion.data, places = motion.places;
    if (!data) return;
    const factor = SHOWN_PERIOD / data.period;
    const pace = factor >= 1 ? "slowed by a factor of " + factor.toPrecision(2) : "sped up by a factor of " + (1 / factor).toPrecision(2);
    const what = data.oscillates
      ? "one period of " + data.period.toPrecision(3) + " s, growth and decay not shown"
      : "one time constant of " + data.period.toPrecision(3) + " s";
    places.said.textContent = what + "; " + (motion.playing ? pace : "still: four instants superimposed");
    places.button.textContent = motion.playing ? "Pause" : "Play";
    places.button.setAttribute("aria-pressed", String(motion.playing));
    places.views.classList.toggle("still", !motion.playing);
  }

  function tick(now) {
    if (motion.data && motion.playing && !document.hidden) {
      const frames = motion.data.views[0].frames;
      draw(Math.floor((((now - motion.began) / 1000 / SHOWN_PERIOD) % 1) * frames));
    }
    if (motion.playing) requestAnimationFrame(tick); // what stands still costs nothing
  }
  function play(playing) {
    if (playing && !motion.playing) requestAnimationFrame(tick);
    motion.playing = playing;
    said();
  }
  requestAnimationFrame(tick);

  function toggle() { play(!motion.playing); }
  quiet.addEventListener("change", function () { play(!quiet.matches); });

  function image(name, format, words) {
    const graph = document.getElementById(name).querySelector(".js-plotly-plot") || document.getElementById(name);
    if (!graph.data) return; // not drawn yet
    const dark = document.documentElement.dataset.theme === "dark";
    const layout = Object.assign({}, graph.layout, { paper_bgcolor: dark ? "#14181d" : "#ffffff", meta: undefined });
    return window.Plotly.downloadImage(
      { data: graph.data, layout: layout },
      { format: format, filename: words, width: graph.clientWidth, height: graph.clientHeight, scale: format === "png" ? 2 : 1 }
    );
  }

  return { table, show, toggle, image };
})();
