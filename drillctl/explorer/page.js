"use strict";
// The page beside its pictures: the form, keys, files, light and dark. What it asks for and what it
// is told are texts of a web socket.
(() => {
  let socket, count = 0, answered = 0, held = null, dragging = false;
  let form = null;
  const by = id => document.getElementById(id);
  const send = what => socket.send(JSON.stringify(what));

  // While something is dragged, the newest place waits until the one before has been answered.
  function ask(what) {
    if (what.settled === false && answered < count) { held = what; return; }
    held = null;
    count += 1;
    document.body.dataset.asked = count;
    document.dispatchEvent(new CustomEvent("asked", { detail: count }));
    send({ ...what, count });
  }

  // ---- the cross: drawn here at once, told to the server
  function drag(event) {
    if (event.type === "pointerdown") { event.currentTarget.setPointerCapture(event.pointerId); dragging = true; }
    if (!dragging) return;
    dragging = event.type === "pointerdown" || event.type === "pointermove";
    const [x, y] = pictures.under(event);
    pictures.cross([x, y]);
    ask({ do: "cross", x, y, settled: !dragging });
  }

  function keys(event) {
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !(typing && event.target.type === "text")) {
      event.preventDefault();
      ask({ do: event.shiftKey ? "redo" : "undo" });
      return;
    }
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!step || typing || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const far = event.shiftKey ? 5 : 1;
    ask({ do: "cross", x: step[0] * far, y: step[1] * far, cells: true, settled: true });
  }

  // ---- the form
  function element(name, attributes = {}, ...inside) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
      else if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
    }
    made.append(...inside);
    return made;
  }

  const idOf = path => "c-" + path.replace(/[^a-z0-9_]/gi, "-");

  function control(one) {
    const id = idOf(one.path);
    const set = settled => event => {
      const value = Number(event.target.value);
      if (event.target.value === "" || !Number.isFinite(value)) { error(one.path, "is not a number"); return; }
      ask({ do: "set", path: one.path, value, settled });
      const other = by(event.target.type === "range" ? id : id + "-range");
      if (other) other.value = value;
    };
    return element("div", { class: "control", title: one.means },
      element("label", { for: id }, one.label + (one.axis === null ? "" : one.axis === 0 ? " (across)" : " (up)")),
      element("input", { id, type: "number", step: "any", value: one.value, onchange: set(true), "aria-describedby": "error-" + id }),
      element("span", { class: "unit" }, one.unit),
      element("input", { id: id + "-range", type: "range", min: one.low, max: one.high, step: pictures.step((one.high - one.low) / 200),
        value: one.value, oninput: set(false), onchange: set(true), "aria-label": one.label }),
      element("p", { class: "error", id: "error-" + id, role: "alert" }));
  }

  function law(path, label, names, own, means) {
    const id = idOf(path);
    const select = element("select", { id, onchange: e => ask({ do: "law", path, value: e.target.value, settled: true }) },
      ...names.map(name => element("option", { value: name, selected: name === own }, name)));
    return element("div", { class: "control", title: means }, element("label", { for: id }, label), select,
      element("p", { class: "error", id: "error-" + id, role: "alert" }));
  }

  function describe(told) {
    const focused = document.activeElement && document.activeElement.id;
    form = told;
    by("title").textContent = "drillctl explorer: " + told.title;
    by("title").title = [told.title, ...told.warnings].join("\n");
    const groups = ["Drilling", "Rock", "Drive", "Dynamic weight"].map(name => {
      const inside = told.ranges.filter(one => one.group === name).map(control);
      if (name === "Drive") inside.unshift(law("controller.law", "law", ...told.laws["controller.law"], "What the top drive does with the speed error"));
      if (name === "Dynamic weight") inside.unshift(law("weight_on_bit.law", "law", ...told.laws["weight_on_bit.law"], "Whether the weight follows the bit speed or an alarm"));
      return element("fieldset", {}, element("legend", {}, name), ...inside);
    });
    by("controls").replaceChildren(...groups);
    by("axes").replaceChildren(...told.axes.map((one, place) => {
      const end = name => element("input", { id: `axis-${place}-${name}`, type: "number", step: "any", value: one[name],
        "aria-label": `${name === "low" ? "least" : "largest"} value ${place ? "up" : "across"}`, onchange: () => ask({ do: "axis", place, path: one.path,
          low: by(`axis-${place}-low`).value, high: by(`axis-${place}-high`).value, settled: true }) });
      return element("label", { title: "Parameter along this side of the map, and its ends" }, place ? "up" : "across",
        element("select", { id: `axis-${place}`, "aria-label": place ? "parameter up" : "parameter across", onchange: e => ask({ do: "axis", place, path: e.target.value, settled: true }) },
          ...Object.entries(told.choices).map(([path, label]) => element("option", { value: path, selected: path === one.path }, label))),
        end("low"), "to", end("high"), element("span", { class: "unit" }, one.unit));
    }), element("p", { class: "error", id: "error-axis", role: "alert" }));
    by("measure").replaceChildren(...Object.entries(told.measures).map(([name, label]) => element("option", { value: name }, label)));
    if (focused && by(focused)) by(focused).focus();
  }

  function values(told) {
    for (const one of form ? form.ranges : []) {
      const id = idOf(one.path), value = told[one.path];
      for (const target of [by(id), by(id + "-range")])
        if (target && value !== undefined && target !== document.activeElement) target.value = value;
        else if (target && target.type === "range" && Math.abs(target.value - value) > Number(target.step)) target.value = value;
    }
    if (told.units === undefined) return; // of a cross that has moved
    by("units").value = told.units;
    by("measure").value = told.measure;
    by("measure").disabled = told.draws > 0;
    by("mode").value = told.draws > 0 ? "200" : "0";
    by("draws-label").hidden = by("level-label").hidden = told.draws === 0;
    if (told.draws) by("draws").value = told.draws;
    by("level").value = told.level;
    by("keep").setAttribute("aria-pressed", told.kept);
    for (const one of document.querySelectorAll(".a-only")) one.hidden = !told.kept;
    by("keep").textContent = told.kept ? "Forget A" : "Keep as A";
  }

  function error(at, said) {
    const target = by("error-" + idOf(at)) || by("error-" + at) || by("error-axis");
    if (target) target.textContent = said;
  }

  function clear() { for (const one of document.querySelectorAll(".error")) one.textContent = ""; }

  function readouts(rows) {
    const compared = rows.some(row => row[3] !== null);
    const line = ([label, unit, value, of_a]) => element("tr", {}, element("th", { scope: "row" }, label), element("td", {}, value ?? ""),
      ...(compared ? [element("td", { class: "a" }, of_a ?? "")] : []), element("td", { class: "unit" }, unit));
    by("readouts").tHead.replaceChildren(...(compared ? [line(["", "", "cross", "A"])] : []));
    by("readouts").tBodies[0].replaceChildren(...rows.map(line));
  }

  function download(file) {
    const url = URL.createObjectURL(new Blob([file.text], { type: "text/plain" }));
    element("a", { href: url, download: file.name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  }

  let copying = "map";
  function copy(text) {
    const tell = said => { by("report-said").textContent = said; };
    navigator.clipboard.writeText(text).then(() => tell("Copied: " + text), () => tell(text));
  }

  const takes = {
    form: describe,
    values,
    undo: can => { by("undo").disabled = !can; },
    redo: can => { by("redo").disabled = !can; },
    fine: () => clear(),
    pictures: pictures.take,
    cross: at => { if (!dragging) pictures.cross(at); },
    // The server waits until this is on the screen before it sends more.
    drew: kinds => {
      document.dispatchEvent(new CustomEvent("drew", { detail: kinds }));
      requestAnimationFrame(() => send({ do: "drawn" }));
    },
    answered: number => {
      document.body.dataset.answered = answered = number;
      if (held && answered >= count) ask(held);
    },
    error: told => error(told.at, told.said),
    problem: told => { const target = by("problem-" + told.of); if (target) target.textContent = told.said; },
    map: told => { by("map-said").textContent = told.said; document.body.dataset.map = told.whole ? "whole" : "coarse"; },
    chip: told => { const chip = by("chip"); chip.textContent = told.text; chip.className = "chip " + told.kind; if (told.more) chip.title = told.more; },
    stale: asked => {
      const target = by("sentence");
      target.classList.add("old");
      if (asked && target.textContent.startsWith("Searching")) target.textContent = "Conditions have changed: ask again what to set.";
      target.title = "Of conditions that have changed since";
    },
    sentence: told => { by("sentence").textContent = told.text; by("sentence").title = ""; by("sentence").className = (told.verdict || "") + (told.old ? " old" : ""); },
    readouts,
    file: download,
    commands: told => copy(told[copying]),
    report: told => {
      by("report-said").replaceChildren(told.href ? element("a", { href: told.href, target: "_blank", rel: "noopener" }, told.said) : told.said);
    },
  };

  // Arrays of numbers come as the bytes of their doubles.
  function unpacked(key, value) {
    if (!value || value.f8 === undefined) return value;
    const text = atob(value.f8), bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
    return new Float64Array(bytes.buffer);
  }

  function answer(event) {
    for (const told of JSON.parse(event.data, unpacked))
      for (const [name, one] of Object.entries(told)) takes[name](one);
  }

  // ---- light and dark
  function paint(dark) {
    document.documentElement.classList.toggle("dark", dark);
    by("scheme").setAttribute("aria-pressed", dark);
    pictures.again();
    try { localStorage.setItem("drillctl-dark", dark ? "1" : "0"); } catch (_) { /* private window */ }
  }

  function buttons() {
    const on = (id, event, call) => by(id).addEventListener(event, call);
    on("undo", "click", () => ask({ do: "undo" }));
    on("redo", "click", () => ask({ do: "redo" }));
    on("save", "click", () => ask({ do: "save" }));
    on("design", "click", () => ask({ do: "design" }));
    on("open", "click", () => by("opened").click());
    on("opened", "change", async event => {
      const file = event.target.files[0];
      if (file) ask({ do: "open", text: await file.text(), settled: true });
      event.target.value = "";
    });
    on("copy-map", "click", () => { copying = "map"; ask({ do: "commands" }); });
    on("copy-run", "click", () => { copying = "run"; ask({ do: "commands" }); });
    on("report", "click", () => ask({ do: "report" }));
    on("recommend", "click", () => ask({ do: "recommend" }));
    on("keep", "click", () => ask({ do: "keep", on: by("keep").getAttribute("aria-pressed") !== "true", settled: true }));
    for (const name of ["units", "measure", "level", "draws"]) on(name, "change", e => ask({ do: "choose", name, value: e.target.value, settled: true }));
    on("mode", "change", e => ask({ do: "choose", name: "draws", value: e.target.value, settled: true }));
    on("scheme", "click", () => paint(!document.documentElement.classList.contains("dark")));
    on("controls", "submit", e => e.preventDefault());
    document.addEventListener("keydown", keys);
    for (const name of ["down", "move", "up", "cancel"]) by("map").addEventListener("pointer" + name, drag);
  }

  function start() {
    buttons();
    let dark = matchMedia("(prefers-color-scheme: dark)").matches;
    try { const held = localStorage.getItem("drillctl-dark"); if (held !== null) dark = held === "1"; } catch (_) { /* private window */ }
    paint(dark);
    socket = new WebSocket(`ws://${location.host}${location.pathname}/ws`);
    socket.onopen = () => ask({ do: "ready" });
    socket.onmessage = answer;
    socket.onclose = () => error("", "The explorer has ended: start it again and reload this page.");
  }

  document.addEventListener("DOMContentLoaded", start);
})();
