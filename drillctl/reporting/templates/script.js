"use strict";
// Maps whose cells tell their values and show their time responses. Without this the picture,
// its caption and the tables say the same of the map as a whole.
(() => {
  const SVG = "http://www.w3.org/2000/svg";

  function shape(name, attributes, parent) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    parent.append(made);
    return made;
  }

  function brief(value) {
    return String(Number(value.toPrecision(4)));
  }

  function setUp(figure) {
    const held = JSON.parse(figure.querySelector(".cells").textContent);
    const over = figure.querySelector(".over"), mark = over.querySelector(".cell");
    const values = figure.querySelector(".values"), trace = figure.querySelector(".trace");
    const counts = held.axes.map((axis) => axis.values.length);
    if (counts.length === 1) counts.push(1);
    let at = start();

    function start() {
      const cell = held.own ?? held.best ?? 0;
      return [Math.floor(cell / counts[1]), cell % counts[1]];
    }
    const index = ([i, j]) => i * counts[1] + j;

    function named([i, j]) {
      return held.axes.map((axis, k) =>
        `${axis.name} ${brief(axis.values[k ? j : i])} ${axis.unit}`.trim()).join(", ");
    }
    function described(where) {
      const cell = index(where), j1 = held.j1[cell];
      const status = held.statuses[held.status[cell]].replace("_", " ");
      return `${named(where)}: ${j1 === null ? "no J1" : `J1 ${brief(j1)} s`}, ${status}`;
    }
    // A picture shows the middle of its first cell at its left edge or half a cell inside it; the
    // limits of the axes are those of the values, half a cell added where colours fill them.
    const filled = held.axes.length === 2 ? 0.5 : 0;
    const margin = held.axes.length === 2 ? 0 : 0.05;

    function cellAt(event) {
      const box = over.getBoundingClientRect();
      const share = [(event.clientX - box.left) / box.width, (box.bottom - event.clientY) / box.height];
      return counts.map((count, k) => {
        const inner = (share[k] - margin / (1 + 2 * margin)) * (1 + 2 * margin);
        const place = inner * (count - 1 + 2 * filled) - filled;
        return Math.min(count - 1, Math.max(0, Math.round(place)));
      });
    }
    function show(where) {
      at = where;
      const [i, j] = where;
      const span = counts.map((count) => count - 1 + 2 * filled || 1);
      const scale = 1 / (1 + 2 * margin);
      const size = held.axes.length === 2 ? [1 / span[0], 1 / span[1]] : [0.004, 1];
      const left = held.axes.length === 2 ? (i + filled - 0.5) / span[0]
        : (margin + i / span[0]) * scale - 0.002;
      const bottom = held.axes.length === 2 ? (j + filled - 0.5) / span[1] : 0;
      Object.assign(mark.style, {
        display: "block", left: `${100 * left}%`, bottom: `${100 * bottom}%`,
        width: `${100 * size[0]}%`, height: `${100 * size[1]}%`,
      });
      values.textContent = described(where);
    }
    function nearest(where) {
      let best = null, least = Infinity;
      held.traced.forEach((cell, row) => {
        const di = (Math.floor(cell / counts[1]) - where[0]) / counts[0];
        const dj = (cell % counts[1] - where[1]) / counts[1];
        const apart = di * di + dj * dj;
        if (apart < least) { least = apart; best = row; }
      });
      return best;
    }
    function respond(where) {
      show(where);
      const row = nearest(where), cell = held.traced[row];
      const from = [Math.floor(cell / counts[1]), cell % counts[1]];
      const title = cell === index(where) ? `Response at ${described(from)}`
        : `Response of the nearest stored cell: ${described(from)}`;
      draw(trace, held, row, title);
      figure.dataset.shown = String(cell);
    }

    over.hidden = false;
    figure.querySelector(".response-text").hidden = false;
    over.tabIndex = 0;
    over.setAttribute("role", "application");
    over.setAttribute("aria-label",
      "Cells of the map: arrow keys move, Enter shows the time response");
    over.addEventListener("pointermove", (event) => show(cellAt(event)));
    over.addEventListener("click", (event) => respond(cellAt(event)));
    over.addEventListener("focus", () => show(at));
    over.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      if (event.key in step) {
        show(at.map((k, d) => Math.min(counts[d] - 1, Math.max(0, k + step[event.key][d]))));
      } else if (event.key === "Enter" || event.key === " ") {
        respond(at);
      } else {
        return;
      }
      event.preventDefault();
    });
    if (held.traced.length) respond(at);
  }

  function draw(place, held, row, title) {
    const width = 640, height = 260, left = 52, right = 24, top = 40, bottom = 42;
    const bit = held.bit[row], motor = held.top[row], asked = held.set_speed[row], count = bit.length;
    const known = [...bit, ...motor].filter((v) => v !== null).map((v) => v / held.part);
    const high = Math.max(1.05 * asked, ...known), low = Math.min(0, ...known);
    const x = (k) => left + (width - left - right) * k / (count - 1);
    const y = (v) => top + (height - top - bottom) * (high - v) / (high - low);
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", title);
    const still = 0.5 * held.part;
    for (let k = 0, first = 0; k <= count; k++) {
      if (k < count && bit[k] !== null && Math.abs(bit[k]) < still) continue;
      if (k > first) {
        shape("rect", { x: x(first), y: top, width: x(k) - x(first),
          height: height - top - bottom, fill: "var(--shade)" }, svg);
      }
      first = k + 1;
    }
    for (const v of ticks(low, high)) {
      shape("line", { x1: left, x2: width - right, y1: y(v), y2: y(v), stroke: "var(--line)" }, svg);
      shape("text", { x: left - 6, y: y(v) + 4, "text-anchor": "end" }, svg).textContent = brief(v);
    }
    for (const t of ticks(0, held.duration)) {
      const k = t / held.duration * (count - 1);
      shape("text", { x: x(k), y: height - bottom + 17, "text-anchor": "middle" }, svg)
        .textContent = brief(t);
    }
    shape("line", { x1: left, x2: width - right, y1: y(asked), y2: y(asked),
      stroke: "var(--ink)", "stroke-dasharray": "2 4" }, svg);
    line(motor, "var(--top)", "6 3");
    line(bit, "var(--bit)", "");
    function line(speeds, stroke, dashes) {
      let path = "", pen = "M";
      speeds.forEach((v, k) => {
        if (v === null) { pen = "M"; return; }
        path += `${pen}${x(k).toFixed(1)} ${y(v / held.part).toFixed(1)}`;
        pen = "L";
      });
      shape("path", { d: path, fill: "none", stroke, "stroke-width": 1.6,
        "stroke-dasharray": dashes }, svg);
    }
    shape("text", { x: 10, y: 18, class: "title" }, svg).textContent = title;
    shape("text", { x: left + (width - left - right) / 2, y: height - 6, "text-anchor": "middle" },
      svg).textContent = "time (s); solid: bit, dashed: top drive, dotted: set speed, grey: bit still";
    const label = shape("text", { transform: `translate(14 ${top + (height - top - bottom) / 2}) rotate(-90)`,
      "text-anchor": "middle" }, svg);
    label.textContent = "speed (rpm)";
    place.replaceChildren(svg);
  }

  function ticks(low, high) {
    const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough);
    const found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9; v += step) found.push(v);
    return found;
  }

  document.querySelectorAll("figure.map").forEach(setUp);
})();
