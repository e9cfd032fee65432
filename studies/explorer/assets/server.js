// How the page asks. What it begins with and what follows a slider is asked of the server by the page itself, in the
// words of Dash; the rest goes through Dash. Its programs are read when the first figure is drawn: they take longer
// than that.
window.velotyreServer = (function () {
  "use strict";
  const held = new Map(); // what is said before Dash is there: the last of each
  let carried = false, called = false;

  function send(id, data) {
    if (carried) window.dash_clientside.set_props(id, { data: data });
    else held.set(id, data);
  }
  function carry() {
    carried = true;
    for (const [id, data] of held) send(id, data);
    held.clear();
  }

  async function ask(name, data) { // what the callback of the store `name` answers, else a message
    const end = (id) => ({ id: id, property: "data" }), question = "ask-" + name;
    const asked = {
      output: name + ".data", outputs: end(name), changedPropIds: [question + ".data"],
      inputs: [Object.assign(end(question), { value: data })],
    };
    try {
      const come = await fetch("/_dash-update-component", {
        method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(asked),
      });
      return come.ok ? (await come.json()).response[name].data : { message: (await come.text()).trim() };
    } catch (error) {
      return { message: "velotyre explore does not answer; start it again in the terminal, then load this page again" };
    }
  }

  function callDash() {
    if (called) return;
    called = true;
    const inside = [...document.getElementById("dash").content.children];
    const read = (script) => new Promise(function (done) {
      const made = document.createElement("script"); // a copy of one that was parsed would not keep its place in the row
      for (const { name, value } of script.attributes) made.setAttribute(name, value);
      made.textContent = script.textContent;
      made.async = false;
      made.onload = made.onerror = done;
      document.body.appendChild(made);
      if (!made.src) done();
    });
    const [programs, rest] = [inside.filter((one) => one.src), inside.filter((one) => !one.src)];
    Promise.all(programs.map(read)).then(() => rest.forEach(read)); // the last one starts it
  }

  return { send, carry, ask, callDash };
})();
