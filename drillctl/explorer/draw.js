"use strict";
// Pictures on canvases, each a value of its two axes and the marks between them that figures.py has
// made; what a map has beside that are an image and, over it, the cross.
const pictures = (() => {
  const VIRIDIS = ["#463480", "#3c508b", "#31688e", "#287c8e", "#20928c", "#2ab07f", "#5ec962", "#addc30", "#fde725"];
  const FONT = "10px system-ui, sans-serif", LABEL = "11px system-ui, sans-serif", BAR = 52;
  const all = {}, boards = {}; // pictures and canvases by name
  let colours = {};
  const colour = name => colours[name] ??= getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

  // The least of 1, 2, 5 times a power of ten that is no less.
  function step(raw) {
    const ten = 10 ** Math.floor(Math.log10(raw));
    return [1, 2, 5, 10].map(k => k * ten).find(one => one >= raw * .999);
  }

  function ticks({ low, high, log }, most) {
    const from = log ? Math.log10(low) : low, to = log ? Math.log10(high) : high;
    const by = log ? Math.ceil((to - from) / most) : step((to - from) / most);
    const found = [];
    for (let k = Math.ceil(from / by - 1e-9); k * by <= to + 1e-9 * by; k++) found.push(log ? 10 ** (k * by) : k * by);
    return found.map(value => ({ value, text: String(Number(value.toPrecision(6))) }));
  }

  // Place (px) of a value, and back.
  function scale({ low, high, log }, from, to) {
    const bent = log ? Math.log10 : value => value, first = bent(low), px = (to - from) / (bent(high) - first);
    return { at: value => from + (bent(value) - first) * px, back: place => first + (place - from) / px };
  }

  function ramp(rising) {
    const stops = (rising ? VIRIDIS : [...VIRIDIS].reverse()).map(one => [1, 3, 5].map(k => parseInt(one.slice(k, k + 2), 16)));
    return Array.from({ length: 256 }, (_, k) => {
      const place = k / 255 * (stops.length - 1), left = Math.min(Math.floor(place), stops.length - 2);
      return stops[left].map((value, part) => value + (place - left) * (stops[left + 1][part] - value));
    });
  }
  const RAMPS = { true: ramp(true), false: ramp(false) };

  // Cells as a small canvas, which is stretched; what has no value stays white.
  function cells({ values, columns, scale: { low, high }, rising }) {
    const rows = values.length / columns, made = new OffscreenCanvas(columns, rows), on = made.getContext("2d");
    const data = on.createImageData(columns, rows);
    data.data.fill(255);
    values.forEach((value, k) => {
      if (Number.isNaN(value)) return;
      const colour = RAMPS[rising][Math.round(255 * Math.min(1, Math.max(0, (value - low) / (high - low))))];
      data.data.set(colour, 4 * ((rows - 1 - Math.floor(k / columns)) * columns + k % columns));
    });
    on.putImageData(data, 0, 0);
    return made;
  }

  const SHAPES = {
    circle: (on, r) => on.arc(0, 0, r, 0, 2 * Math.PI),
    square: (on, r) => on.rect(-r, -r, 2 * r, 2 * r),
    cross: (on, r) => { on.moveTo(-r, -r); on.lineTo(r, r); on.moveTo(-r, r); on.lineTo(r, -r); },
    star: (on, r) => {
      for (let k = 0; k < 10; k++) on.lineTo(...[Math.sin, Math.cos].map(f => f(k * Math.PI / 5) * (k % 2 ? .4 * r : -r)));
      on.closePath();
    },
  };
  const MARKS = {
    image(on, told, across, up) {
      const left = across.at(told.x[0]), top = up.at(told.y[1]);
      on.imageSmoothingEnabled = false;
      on.drawImage(cells(told), left, top, across.at(told.x[1]) - left, up.at(told.y[0]) - top);
    },
    line(on, { x, y, fill }, across, up) {
      on.beginPath();
      let gap = true;
      for (let k = 0; k < x.length; k++) {
        const px = across.at(x[k]), py = up.at(y[k]), drawn = Number.isFinite(px) && Number.isFinite(py);
        if (drawn && gap) on.moveTo(px, py);
        else if (drawn) on.lineTo(px, py);
        gap = !drawn;
      }
      on.stroke();
      if (fill) { on.globalAlpha = fill; on.fill(); }
    },
    points(on, { x, y, shape, size }, across, up) {
      for (let k = 0; k < x.length; k++) {
        on.save();
        on.translate(across.at(x[k]), up.at(y[k]));
        on.beginPath();
        SHAPES[shape](on, size);
        const ink = on.strokeStyle;
        if (shape !== "cross") { on.strokeStyle = "#fff"; on.lineWidth = 3; on.stroke(); } // on a map
        on.strokeStyle = ink;
        on.lineWidth = 1.4;
        if (shape === "star") on.fill();
        else on.stroke();
        on.restore();
      }
    },
    texts(on, { x, y, texts }, across, up) {
      on.textAlign = "center";
      texts.forEach((text, k) => {
        const px = across.at(x[k]), py = up.at(y[k]), half = on.measureText(text).width / 2 + 2;
        on.fillStyle = "rgba(255,255,255,.75)";
        on.fillRect(px - half, py - 7, 2 * half, 14);
        on.fillStyle = "#000";
        on.fillText(text, px, py);
      });
    },
  };

  // The colours of an image, beside the frame.
  function bar(on, { scale: shades, rising }, { right, top, bottom }) {
    const ladder = cells({ values: Float64Array.from({ length: 64 }, (_, k) => k), columns: 1, scale: { low: 0, high: 63 }, rising });
    on.imageSmoothingEnabled = false;
    on.drawImage(ladder, right + 8, top, 10, bottom - top);
    on.fillStyle = colour("ink");
    on.textAlign = "left";
    const place = scale(shades, bottom, top);
    for (const { value, text } of ticks(shades, 6)) on.fillText(text, right + 21, place.at(value));
    on.textAlign = "right";
    on.fillText(shades.label, right + BAR - 4, top - 14);
  }

  // Where a picture has its frame (px), ticks and scales.
  function framed({ x, y, equal }, { on, over, width, height }) {
    const rungs = ticks(y, Math.max(2, height / 45)), wide = Math.max(20, ...rungs.map(tick => on.measureText(tick.text).width));
    const left = wide + 24, right = width - (over ? BAR : 12), top = over ? 22 : 6, bottom = height - (x.bare ? 16 : 30);
    if (equal) { // as many px to one across as up
      const unit = Math.max((x.high - x.low) / (right - left), (y.high - y.low) / (bottom - top));
      [x, y] = [[x, right - left], [y, bottom - top]].map(([side, px]) => {
        const middle = (side.low + side.high) / 2;
        return { ...side, low: middle - unit * px / 2, high: middle + unit * px / 2 };
      });
    }
    return { left, right, top, bottom, rungs, columns: ticks(x, Math.max(2, (right - left) / 45)),
      across: scale(x, left, right), up: scale(y, bottom, top) };
  }

  function axes(on, { x, y, image }, { left, right, top, bottom, rungs, columns, across, up }) {
    on.strokeStyle = colour("grid");
    on.lineWidth = 1;
    on.setLineDash([]);
    on.beginPath();
    if (!image) {
      for (const { value } of columns) { on.moveTo(across.at(value), top); on.lineTo(across.at(value), bottom); }
      for (const { value } of rungs) { on.moveTo(left, up.at(value)); on.lineTo(right, up.at(value)); }
    }
    on.rect(left, top, right - left, bottom - top);
    on.stroke();
    on.fillStyle = colour("ink");
    on.textAlign = "center";
    for (const { value, text } of columns) on.fillText(text, across.at(value), bottom + 9);
    on.textAlign = "right";
    for (const { value, text } of rungs) on.fillText(text, left - 4, up.at(value));
    on.font = LABEL;
    on.textAlign = "center";
    if (!x.bare) on.fillText(x.label, (left + right) / 2, bottom + 22);
    on.save();
    on.translate(9, (top + bottom) / 2);
    on.rotate(-Math.PI / 2);
    on.fillText(y.label, 0, 0);
    on.restore();
    on.font = FONT;
  }

  function draw(name) {
    const one = all[name], made = board(name), { on, canvas, width, height } = made;
    if (!one || !width || !height) return;
    on.font = FONT;
    on.textBaseline = "middle";
    on.lineJoin = "round";
    on.fillStyle = colour("paper");
    on.fillRect(0, 0, width, height);
    const frame = made.frame = framed(one, made), { left, right, top, bottom, across, up } = frame;
    axes(on, one, frame);
    if (one.image) bar(on, one.image, frame);
    on.save();
    on.beginPath();
    on.rect(left, top, right - left, bottom - top);
    on.clip();
    for (const mark of one.image ? [one.image, ...one.marks] : one.marks) {
      on.globalAlpha = mark.alpha || 1;
      on.lineWidth = mark.width || 1.4;
      on.setLineDash(mark.dash || []);
      if (mark.colour) on.strokeStyle = on.fillStyle = colour(mark.colour);
      MARKS[mark.kind](on, mark, across, up);
    }
    on.restore();
    const side = ({ label, low, high }) => `${label} from ${low.toPrecision(3)} to ${high.toPrecision(3)}`;
    canvas.setAttribute("aria-label", `${canvas.dataset.name}: ${side(one.y)} over ${side(one.x)}`);
    if (made.cross) cross(made.cross);
  }

  // The cross of the map is of elements that are moved: a canvas over it would be copied each time.
  function cross(at) {
    const made = board("map"), { over, width, height, frame } = made;
    made.cross = at;
    if (!frame) return;
    const { left, right, top, bottom, across, up } = frame, x = across.at(at[0]) - left, y = up.at(at[1]) - top;
    over.style.inset = `${top}px ${width - right}px ${height - bottom}px ${left}px`;
    for (const one of over.children) one.style.transform = `translate(${one.dataset.x * x}px, ${one.dataset.y * y}px)`;
  }

  // Values of the map at a place (px) of the page, inside its frame.
  function under(event) {
    const { canvas, frame: { left, right, top, bottom, across, up } } = board("map"), box = canvas.getBoundingClientRect();
    const inside = (value, low, high) => Math.min(high, Math.max(low, value));
    return [across.back(inside(event.clientX - box.left, left, right)), up.back(inside(event.clientY - box.top, top, bottom))];
  }

  // ---- canvases
  function board(name) {
    if (boards[name]) return boards[name];
    const home = document.getElementById(name), [canvas, over] = home.children;
    const made = boards[name] = { canvas, over, on: canvas.getContext("2d") };
    const size = () => {
      made.width = home.clientWidth;
      made.height = home.clientHeight;
      canvas.width = made.width * devicePixelRatio;
      canvas.height = made.height * devicePixelRatio;
      made.on.scale(devicePixelRatio, devicePixelRatio);
    };
    size();
    new ResizeObserver(() => {
      if (made.width === home.clientWidth && made.height === home.clientHeight) return;
      size();
      draw(name);
    }).observe(home);
    return made;
  }

  function take(told) {
    for (const [name, one] of Object.entries(told)) { all[name] = one; draw(name); }
  }

  // In the colours of a scheme that has changed.
  function again() {
    colours = {};
    Object.keys(all).forEach(draw);
  }

  return { all, take, again, cross, under, step };
})();
