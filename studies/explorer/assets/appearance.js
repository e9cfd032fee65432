// Light and dark, as the system says or as the user chose; kept for the next visit.
window.velotyreTheme = (function () {
  "use strict";
  const darkness = window.matchMedia("(prefers-color-scheme: dark)");
  const heard = [];
  function kept(value) {
    try { if (value !== undefined) localStorage.setItem("velotyre-theme", value); return localStorage.getItem("velotyre-theme"); }
    catch (error) { return null; }
  }
  function now() {
    const asked = kept() || "auto";
    return asked === "auto" ? (darkness.matches ? "dark" : "light") : asked;
  }
  function show() {
    document.documentElement.dataset.theme = now();
    for (const tell of heard) tell(now());
  }
  function choose(choice) { kept(choice); show(); }
  function place(where) {
    where.innerHTML = '<label for="theme">Colours</label> <select id="theme"><option value="auto">as the system</option><option value="light">light</option><option value="dark">dark</option></select>';
    document.getElementById("theme").value = kept() || "auto";
  }
  darkness.addEventListener("change", show);
  show();
  return { now, choose, place, hear: (tell) => heard.push(tell) };
})();
