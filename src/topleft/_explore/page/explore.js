// The page of the explorer. It asks Python for everything that is drawn, and draws no triangle by itself: pictures are
// arrays of pixels that come from the library; lines and handles are laid over them.

// ---- questions and answers -------------------------------------------------------------------------------------

const ARRAYS = {
  uint8: Uint8ClampedArray, int32: Int32Array, float32: Float32Array, float64: Float64Array, uint16: Uint16Array,
  int64: BigInt64Array, uint32: Uint32Array, int16: Int16Array,
};

// Typed arrays, with their shape, in place of their descriptions in a header.
function withArrays(header, parts) {
  for (const [name, {dtype, shape, part}] of Object.entries(header.arrays ?? {})) {
    const {buffer, byteOffset, byteLength} = parts[part];
    const kind = ARRAYS[dtype];
    const array = new kind(buffer, byteOffset, byteLength / kind.BYTES_PER_ELEMENT);
    header.arrays[name] = Object.assign(array, {shape});
  }
  return header;
}

const padding = (n) => (8 - n % 8) % 8;

// A frame as messages.py describes it.
function pack(header, parts) {
  const text = new TextEncoder().encode(JSON.stringify({...header, parts: parts.map((part) => part.byteLength)}));
  const start = 4 + text.length + padding(4 + text.length);
  const frame = new Uint8Array(start + parts.reduce((n, part) => n + part.byteLength + padding(part.byteLength), 0));
  new DataView(frame.buffer).setUint32(0, start - 4, true);
  frame.fill(32, 4, start).set(text, 4);
  let at = start;
  for (const part of parts) {
    frame.set(part, at);
    at += part.byteLength + padding(part.byteLength);
  }
  return frame;
}

function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const parts = header.parts.map((n) => {
    const part = new Uint8Array(buffer, at, n);
    at += n + padding(n);
    return part;
  });
  return withArrays(header, parts);
}

// ask("name", {...}) promises the answer to a question; what Python refuses is an Error with its sentence.
class Line {
  constructor(send, onLost) {
    Object.assign(this, {send, onLost, next: 1, waiting: new Map()});
  }
  ask(name, given = {}, parts = []) {
    const id = this.next++;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, {resolve, reject});
      this.send({...given, do: name, id}, parts);
    });
  }
  hear(header) {
    const {resolve, reject} = this.waiting.get(header.id) ?? {};
    this.waiting.delete(header.id);
    if (header.error) (reject ?? console.error)(new Error(header.error));
    else resolve?.(header);
  }
  lose() {
    for (const {reject} of this.waiting.values()) reject(new Error("the connection is closed"));
    this.waiting.clear();
    this.onLost?.();
  }
}

function socketLine(onLost) {
  const socket = new WebSocket(new URL("socket", document.baseURI).href.replace(/^http/, "ws").replace(/#.*/, ""));
  socket.binaryType = "arraybuffer";
  const line = new Line((header, parts) => socket.send(pack(header, parts)), onLost);
  socket.onmessage = ({data}) => line.hear(unpack(data));
  socket.onclose = () => line.lose();
  return new Promise((resolve, reject) => {
    socket.onopen = () => resolve(line);
    socket.onerror = () => reject(new Error("the explorer has ended: start it again"));
  });
}

function notebookLine(model) {
  const line = new Line((header, parts) => model.send({...header, parts: []}, undefined, parts));
  model.on("msg:custom", (header, parts) => line.hear(withArrays(header, parts)));
  return line;
}

// Calls a function that takes time with the newest arguments alone, one call at a time: a drag asks for no more
// pictures than come back.
function newest(work) {
  let isBusy = false, waiting = null;
  return async function call(...given) {
    if (isBusy) return void (waiting = given);
    isBusy = true;
    try {
      await work(...given);
    } finally {
      isBusy = false;
      if (waiting) [given, waiting] = [waiting, null], call(...given);
    }
  };
}

// ---- what all parts use ----------------------------------------------------------------------------------------

// An element: make("button.main", {onclick}, "text", child, ...).
function make(what, properties = {}, ...children) {
  const [name, ...classes] = what.split(".");
  const element = document.createElement(name);
  element.className = classes.join(" ");
  for (const [key, value] of Object.entries(properties)) {
    if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children.flat());
  return element;
}

// The same for SVG, whose properties are attributes.
function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

const group = (title, ...children) => make("section.group", {}, make("h2", {}, title), ...children);
const row = (label, control) => make("label.row", {}, make("span", {}, label), control);
const button = (text, onclick, title = "") => make("button", {type: "button", title, onclick}, text);

// A row with a choice of [value, text], or of words.
function choose(label, options, value, write) {
  const box = make("select", {onchange: () => write(box.value)}, options.map(([own, text = own]) => make("option", {value: own}, `${text}`)));
  box.value = value;
  return row(label, box);
}

function download(name, content, type = "") {
  const href = URL.createObjectURL(new Blob([content], {type}));
  make("a", {href, download: name}).click();
  setTimeout(() => URL.revokeObjectURL(href), 10000);
}

// A picture (H, W, 4) uint8 of Python's as it is, a canvas pixel for each of its pixels.
function paint(canvas, pixels) {
  const [height, width] = pixels.shape;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  canvas.getContext("2d").putImageData(new ImageData(pixels, width, height), 0, 0);
}

// The parts of the page. `enter` is called when its tab is shown, `state` is what goes into the link of the page, and
// `restore` takes it back.
const PARTS = {pixels: pixelsPart, steps: stepsPart, mesh: meshPart, race: racePart};

// ---- Pixels ----------------------------------------------------------------------------------------------------

// Colours of triangles, and of what is drawn again: Okabe and Ito's, which all eyes tell apart.
const OWNERS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167]], TWICE = [213, 94, 0];

const PIXEL_DEFAULTS = {
  origin: [0, 0], method: "auto", other: "", exact: false, subpixel_bits: 8, sampling: "center", cull: "none",
  depth_test: "less", winding: "as given", look: "owners",
};
const COLORS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442"];
const DIFFERENCES = [
  [1, "#80808046", () => "same"], [2, "#0072b2", (a) => `${a} alone`], [3, "#e69f00", (a, b) => `${b} alone`],
  [4, "#cc79a7", () => "another owner"], [5, "#d55e00", () => "drawn more often"],
];
const MOVES = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
  a: [-1, 0], d: [1, 0], w: [0, -1], s: [0, 1],
};
const KEYS = [
  ["1 2 3", "take a corner"], ["0", "take none"], ["arrows, WASD", "move it by a sub-pixel, or look at the next pixel"],
  ["Shift", "by a pixel"], ["[ ]", "the next triangle"], ["Tab", "the next scene"], ["F", "wireframe"], ["Z", "undo"],
  ["N P R Del", "add, split, flip, remove"], ["Esc", "leave the picture"],
];

function pixelsPart(app, panel) {
  const part = {state: () => state, scene: () => state, drawn: null, enter, restore, views: new Map()};
  const {methods, scenes} = app.hello;
  const bases = [...new Set(methods.map(({name}) => name.split("/")[0]))];
  let state = {}, sceneName = app.hello.pixels.scene ?? "", chosen = 0, corner = null, snap = "sub-pixel";
  let pixel = null, probed = "a", samples = [], past = [], isRefused = false;

  // -- what is asked --

  const redraw = newest(async () => {
    const asked = state;
    try {
      show(await app.line.ask("pixels.draw", {state: asked}));
      if (isRefused) app.say("");
      isRefused = false;
    } catch (error) {
      isRefused = true;
      app.say(error.message, true);
    }
    part.drawn = asked;
    part.onDrawn?.();
  });
  const explain = newest(async () => {
    if (plan.open) plan.lastChild.textContent = (await app.line.ask("pixels.plan", {state})).text;
  });
  const look = newest(async () => {
    if (!pixel) return;
    const method = {b: state.other, exact: "exact"}[probed] || state.method;
    try {
      tell(await app.line.ask("pixels.probe", {state, pixel, method}));
    } catch (error) {
      why.replaceChildren(make("p", {}, error.message));
    }
  });

  // Every change goes through here: `remember` lets Z take it back.
  function change(next, remember = true) {
    if (remember) past = [...past.slice(-199), state];
    state = {...state, ...next};
    if (pixel && (pixel[0] >= state.size[0] || pixel[1] >= state.size[1])) pixel = null;
    chosen = Math.max(0, Math.min(chosen, state.triangles.length - 1));
    overlay();
    controls();
    redraw(), look(), explain(), app.keep();
  }
  function restore(given) {
    past = [];
    [corner, pixel, chosen] = [null, null, 0];
    change({...PIXEL_DEFAULTS, ...given}, false);
  }
  async function takeScene(name) {
    sceneName = name;
    const before = state;
    try {
      const {state: scene} = await app.line.ask("pixels.scene", {name});
      [corner, pixel, chosen] = [null, null, 0];
      change({...PIXEL_DEFAULTS, ...("method" in scene || "other" in scene ? {} : kept(before)), ...scene}, false);
      past = [...past, before];
      app.say(name);
    } catch (error) {
      app.say(error.message, true);
    }
  }
  const kept = ({method, other, exact, look}) => ({method, other, exact, look});
  const nextScene = (step) => takeScene(scenes.at((Math.max(0, scenes.indexOf(sceneName)) + step) % scenes.length));

  // -- triangles --

  const step = () => 2 ** -(state.subpixel_bits === "exact" ? 8 : state.subpixel_bits);
  const snapped = (x) => {
    if (snap === "pixel centre") return Math.floor(x) + 0.5;
    const grid = snap === "free" ? 2 ** -20 : step();
    return Math.round(x / grid) * grid;
  };
  function move(i, [x, y], remember) {
    change({vertices: state.vertices.map((row, k) => k === i ? [x, y, ...row.slice(2)] : row)}, remember);
  }
  const edits = {
    add() {
      const [x, y] = [0, 1].map((k) => state.origin[k] + Math.floor(state.size[k] / 2));
      const r = Math.max(2, Math.floor(Math.min(...state.size) / 4)), n = state.vertices.length;
      const z = (state.vertices[0] ?? []).slice(2);
      const added = [[x - r, y + r, ...z], [x, y - r, ...z], [x + r, y + r, ...z]];
      chosen = state.triangles.length;
      change({vertices: [...state.vertices, ...added], triangles: [...state.triangles, [n, n + 1, n + 2]]});
    },
    split() {
      const [a, b, c] = state.triangles[chosen], n = state.vertices.length;
      const middle = state.vertices[a].map((_, k) => [a, b, c].reduce((sum, i) => sum + state.vertices[i][k], 0) / 3);
      const [x, y, ...z] = middle, parts = [[a, b, n], [b, c, n], [c, a, n]];
      change({
        vertices: [...state.vertices, [snapped(x), snapped(y), ...z]], triangles: state.triangles.toSpliced(chosen, 1, ...parts),
      });
    },
    flip() {
      const [a, b, c] = state.triangles[chosen];
      change({triangles: state.triangles.with(chosen, [a, c, b])});
    },
    remove() {
      const triangles = state.triangles.toSpliced(chosen, 1), used = [...new Set(triangles.flat())].sort((i, j) => i - j);
      corner = null;
      change({
        vertices: used.map((i) => state.vertices[i]), triangles: triangles.map((row) => row.map((i) => used.indexOf(i))),
      });
    },
    undo() {
      if (past.length) state = past.pop(), change({}, false);
    },
  };

  // -- the picture --

  const panels = make("div.panels");
  const why = make("div.why", {"aria-live": "polite"}, make("p", {}, "Point at a pixel, or move over the picture with the arrows."));
  const stage = make("div.stage", {
    tabIndex: 0, role: "application", onkeydown: press,
    "aria-label": "Magnified pixels. Arrows look at pixels, 1 2 3 take a corner, Tab takes the next scene, Escape leaves.",
  }, panels);

  let fitted = "";
  function show({panels: shown, arrays, samples: at}) {
    const isNew = samples.length !== at.length;
    samples = at;
    for (const key of part.views.keys()) {
      if (!shown.some((one) => one.key === key)) part.views.get(key).figure.remove(), part.views.delete(key);
    }
    for (const one of shown) {
      if (!part.views.has(one.key)) part.views.set(one.key, view(one.key));
      const {figure, canvas, box, caption, legend} = part.views.get(one.key);
      Object.assign(part.views.get(one.key), {owners: arrays[`${one.key}_owners`], counts: arrays[`${one.key}_counts`]});
      panels.append(figure);
      caption.replaceChildren(...facts(one));
      legend.replaceChildren(...(one.refused ? [make("div.refused", {}, one.refused)] : keys(one)));
      box.hidden = Boolean(one.refused);
      if (arrays[one.key]) paint(canvas, arrays[one.key]);
    }
    const wanted = JSON.stringify([shown.map(({key}) => key), state.size]);
    if (wanted !== fitted) fitted = wanted, fit();
    else if (state.look === "overdraw" || isNew) overlay();
  }
  function facts({key, title, ms, n, n_wrong, n_twice, notes, kinds}) {
    if (key === "difference") {
      const n = kinds.slice(2).reduce((sum, k) => sum + k, 0);
      return [make("b", {}, "difference"), make("div", {}, make(`span${n ? ".bad" : ".good"}`, {}, n === 1 ? "1 pixel" : `${n.toLocaleString("en")} pixels`))];
    }
    if (n === undefined) return [make("b", {}, title)];
    const facts = [make("span", {}, `${n.toLocaleString("en")} px`), make("span", {}, time(ms))];
    if (n_twice) facts.push(make("span", {}, `${n_twice.toLocaleString("en")} twice`));
    if (n_wrong !== undefined) facts.push(make(n_wrong ? "span.bad" : "span.good", {}, n_wrong ? `${n_wrong} wrong` : "all exact"));
    return [make("b", {}, title), make("span", {}, notes.join(", ")), make("div", {}, ...facts)];
  }
  const time = (ms) => ms < 1 ? `${(1000 * ms).toFixed(0)} µs` : `${ms.toFixed(1)} ms`;
  function keys({key, kinds, of}) {
    if (key === "difference") {
      return DIFFERENCES.filter(([k]) => kinds[k]).map(([k, color, word]) =>
        make("span", {}, make("i", {style: `background:${color}`}), `${kinds[k].toLocaleString("en")} ${word(...of)}`));
    }
    if (state.look !== "overdraw") return [];
    return ["#9ecae1", "#e69f00", "#d55e00", "#7a1f5c"].map((color, i) =>
      make("span", {}, make("i", {style: `background:${color}`}), ["once", "twice", "3 times", "4 or more"][i]));
  }

  function view(key) {
    const canvas = make("canvas"), sheet = svg("svg", {"aria-hidden": "true"});
    const box = make("div.view", {}, canvas, sheet), caption = make("figcaption"), legend = make("div.legend");
    const figure = make("figure.panel", {"data-key": key}, caption, box, legend);
    let dragged = null;
    const place = ({clientX, clientY}) => {
      const {left, top} = sheet.getBoundingClientRect(), cell = part.cell;
      return [(clientX - left) / cell - 1 + state.origin[0], (clientY - top) / cell - 1 + state.origin[1]];
    };
    const nearest = (event) => {
      const [x, y] = place(event), reach = (event.pointerType === "touch" ? 26 : 13) / part.cell;
      const far = state.vertices.map((v) => Math.hypot(v[0] - x, v[1] - y));
      const taken = corner === null ? -1 : state.triangles[chosen]?.[corner] ?? -1;
      if (taken >= 0 && far[taken] <= reach) return taken;
      const i = far.indexOf(Math.min(...far));
      return far[i] <= reach ? i : null;
    };
    const at = (event) => place(event).map((value, k) => Math.floor(value - state.origin[k]));
    const isInside = ([x, y]) => x >= 0 && y >= 0 && x < state.size[0] && y < state.size[1];
    sheet.onpointerdown = (event) => {
      if (event.button) return;
      stage.focus({preventScroll: true});
      const i = nearest(event);
      if (i === null) {
        const [x, y] = at(event), {owners} = part.views.get(key);
        if (isInside([x, y])) {
          const owner = owners?.[y * state.size[0] + x] ?? -1;
          if (owner >= 0) chosen = owner;
          inspect([x, y], key);
          overlay(), controls();
        }
        return;
      }
      dragged = i;
      if (!state.triangles[chosen]?.includes(i)) chosen = Math.max(0, state.triangles.findIndex((row) => row.includes(i)));
      corner = Math.max(0, state.triangles[chosen]?.indexOf(i) ?? 0);
      past = [...past.slice(-199), state];
      sheet.setPointerCapture(event.pointerId);
      overlay(), controls();
    };
    sheet.onpointermove = (event) => {
      if (dragged !== null) move(dragged, place(event).map(snapped), false);
      else if (event.pointerType === "mouse" && isInside(at(event))) inspect(at(event), key);
    };
    sheet.onpointerup = sheet.onpointercancel = () => { dragged = null; };
    return {figure, canvas, sheet, box, caption, legend};
  }
  function inspect(at, key = probed) {
    if (pixel && pixel[0] === at[0] && pixel[1] === at[1] && probed === key) return;
    pixel = at;
    probed = key;
    look();
    for (const {sheet} of part.views.values()) ring(sheet.querySelector(".ring"));
  }
  const ring = (rect) => {
    if (rect) for (const [name, value] of Object.entries(pixel ? {x: pixel[0], y: pixel[1], width: 1, height: 1} : {width: 0})) rect.setAttribute(name, value);
  };

  // The largest whole number of screen pixels a pixel that lets all pictures fit, in the columns that allow most.
  function fit() {
    const n = part.views.size, [width, height] = state.size, isNarrow = stage.clientWidth < 480;
    const room = isNarrow ? Infinity : Math.max(420, innerHeight - 120);
    let best = [0, 1];
    for (let columns = 1; columns <= n; columns++) {
      const wide = ((stage.clientWidth + 24) / columns - 24) / (width + 2);
      const high = (room / Math.ceil(n / columns) - 84) / (height + 2);
      const cell = Math.max(1, Math.floor(Math.min(wide, high, 44)));
      if (cell > best[0]) best = [cell, columns];
    }
    const [cell, columns] = isNarrow ? [Math.max(1, Math.floor(Math.min(stage.clientWidth / (width + 2), 44))), 1] : best;
    part.cell = cell;
    panels.style.gridTemplateColumns = `repeat(${columns}, ${Math.max(cell * (width + 2), 200)}px)`;
    for (const {canvas, box} of part.views.values()) {
      Object.assign(box.style, {width: `${cell * (width + 2)}px`, height: `${cell * (height + 2)}px`});
      Object.assign(canvas.style, {left: `${cell}px`, top: `${cell}px`, width: `${cell * width}px`, height: `${cell * height}px`});
    }
    overlay();
  }

  // Lines, dots and handles over the pixels: no pixel is decided here.
  function overlay() {
    const [width, height] = state.size, [ox, oy] = state.origin, cell = part.cell || 1;
    const points = state.vertices.map(([x, y]) => [x - ox, y - oy]), taken = state.triangles[chosen] ?? [];
    const near = ([x, y]) => Math.abs(x) < 1e5 && Math.abs(y) < 1e5;
    const outline = (rows) => rows.filter((row) => row.every((i) => near(points[i])))
      .map((row) => `M${row.map((i) => points[i].join(" ")).join("L")}Z`).join("");
    const all = outline(state.triangles), one = outline(state.triangles.length > 1 && taken.length ? [taken] : []);
    const kind = [cell, width, height, samples.length].join("-");
    for (const {sheet, counts} of part.views.values()) {
      if (sheet.dataset.kind !== kind) {
        sheet.dataset.kind = kind;
        sheet.setAttribute("viewBox", `-1 -1 ${width + 2} ${height + 2}`);
        sheet.replaceChildren(...ruled(width, height, cell, kind), svg("g"));
      }
      const numbers = cell < 14 || !counts || state.look !== "overdraw" ? [] : [...counts].flatMap((n, i) =>
        n > 1 ? [Object.assign(svg("text", {x: i % width + 0.5, y: Math.floor(i / width) + 0.5}), {textContent: n})] : []);
      sheet.lastChild.replaceChildren(
        svg("g", {class: "counts"}, ...numbers), svg("path", {class: "halo", d: all}), svg("path", {class: "edges", d: all}),
        svg("path", {class: "taken", d: one}), svg("rect", {class: "ring", fill: "none"}),
        ...points.flatMap((point, i) => near(point) ? [grip(point, taken.indexOf(i), cell)] : []),
      );
      ring(sheet.querySelector(".ring"));
    }
  }
  // Lines between pixels and dots at samples, where there is room for them.
  function ruled(width, height, cell, kind) {
    const bars = (n, line) => Array.from({length: n + 1}, (_, i) => line(i)).join("");
    const lines = cell < 5 ? "" : bars(width, (x) => `M${x} 0V${height}`) + bars(height, (y) => `M0 ${y}H${width}`);
    if (cell < 9 || !samples.length) return [svg("path", {class: "lines", d: lines})];
    const dots = samples.map(([cx, cy]) => svg("circle", {class: "dots", cx, cy, r: (samples.length > 4 ? 1 : 1.5) / cell}));
    const pattern = svg("pattern", {id: `dots-${kind}`, width: 1, height: 1, patternUnits: "userSpaceOnUse"}, ...dots);
    return [svg("defs", {}, pattern), svg("path", {class: "lines", d: lines}), svg("rect", {width, height, fill: `url(#dots-${kind})`})];
  }
  function grip([x, y], k, cell) {
    const isTaken = corner !== null && k === corner;
    const parts = [svg("circle", {class: "reach", cx: x, cy: y, r: 22 / cell}), svg("circle", {class: "knob", cx: x, cy: y, r: (k < 0 ? 4 : 8) / cell})];
    if (k >= 0) parts.push(Object.assign(svg("text", {x, y, "font-size": 11 / cell}), {textContent: k + 1}));
    return svg("g", {class: isTaken ? "grip taken" : "grip"}, ...parts);
  }

  // -- why a pixel is whose --

  function tell({sentences, rows, n_more}) {
    const edge = ({ends: [a, b], kind, value, exact}) => make("tr", {}, make("th", {scope: "row"}, `${Math.min(a, b)}–${Math.max(a, b)}`),
      make("td", {}, kind), make("td", {title: `exactly ${exact} square pixels, twice the area to this edge`},
        make(value === "0" ? "b.zero" : "span", {}, value)));
    const card = ({triangle, verdict, edges, weights, depth}) => make("section.card", {},
      make("h3", {}, make("i", {style: `background:${COLORS[triangle % 7]}`}), `triangle ${triangle}`, make("small", {}, verdict)),
      make("table", {}, ...edges.map(edge)),
      make("p", {}, `weights ${weights.join(", ")}`, ...(depth === null ? [] : [make("br"), `depth ${depth}`])));
    why.replaceChildren(...sentences.map((text) => make("p", {}, text)), make("div.cards", {}, ...rows.map(card)));
    if (n_more) why.append(make("p.hint", {}, `${n_more} more triangles are farther away.`));
  }

  // -- keys --

  function press(event) {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const move_ = MOVES[key];
    if (move_) {
      const i = corner === null ? undefined : state.triangles[chosen]?.[corner];
      const far = event.shiftKey ? 1 : step();
      if (i !== undefined) move(i, state.vertices[i].slice(0, 2).map((v, k) => v + far * move_[k]));
      else inspect([0, 1].map((k) => Math.max(0, Math.min(state.size[k] - 1, (pixel ?? [0, 0])[k] + (event.shiftKey ? 8 : 1) * move_[k]))));
    } else if ("123".includes(key)) corner = Number(key) - 1;
    else if (key === "0") corner = null;
    else if (key === "[" || key === "]") chosen = (chosen + (key === "]" ? 1 : -1) + state.triangles.length) % Math.max(1, state.triangles.length);
    else if (key === "Tab") nextScene(event.shiftKey ? -1 : 1);
    else if (key === "f") change({look: state.look === "wireframe" ? "owners" : "wireframe"});
    else if (key === "z") edits.undo();
    else if (key === "n") edits.add();
    else if (key === "Escape") side.querySelector("select").focus();
    else if (state.triangles.length && {p: "split", r: "flip", Delete: "remove"}[key]) edits[{p: "split", r: "flip", Delete: "remove"}[key]]();
    else return;
    event.preventDefault();
    overlay(), controls();
  }

  // -- the column of choices --

  const sync = [];
  const controls = () => sync.forEach((update) => update());
  const select = (label, options, read, write) => {
    const box = make("select", {"aria-label": label, onchange: () => write(box.value)});
    const list = (wanted) => box.replaceChildren(...wanted.map(([value, text, title = ""]) => make("option", {value, title}, text)));
    if (typeof options !== "function") list(options);
    sync.push(() => {
      if (typeof options === "function") list(options());
      box.value = read();
    });
    return box;
  };
  const plain = (...words) => words.map((word) => [word, word]);
  const choice = (label, name, options) => row(label, select(label, options, () => `${state[name]}`, (value) =>
    change({[name]: name === "subpixel_bits" && value !== "exact" ? Number(value) : value})));
  const segments = (label, words, read, write) => {
    const buttons = words.map((word) => make("button", {type: "button", onclick: () => (write(word), controls())}, word));
    sync.push(() => buttons.forEach((button, i) => button.setAttribute("aria-pressed", words[i] === read())));
    return make("div.segments", {role: "group", "aria-label": label}, ...buttons);
  };
  const method = (label, name, more = []) => {
    const variants = () => methods.filter((one) => one.name.split("/")[0] === state[name].split("/")[0])
      .map((one) => [one.name, one.name.split("/")[1] ?? "as published", one.summary]);
    const variant = row("variant", select(`${label}, variant`, variants, () => state[name], (value) => change({[name]: value})));
    sync.push(() => { variant.hidden = variants().length < 2; });
    const names = [...more, ...bases.map((base) => [base, base, methods.find((one) => one.name === base).summary])];
    return [row(label, select(label, names, () => state[name].split("/")[0], (value) => change({[name]: value}))), variant];
  };
  const check = (label, name) => {
    const box = make("input", {type: "checkbox", onchange: () => change({[name]: box.checked})});
    sync.push(() => { box.checked = state[name]; });
    return make("label.check", {}, box, label);
  };
  const number = (read, write, more = {}) => {
    const box = make("input", {type: "number", step: "any", ...more, onchange: () => Number.isFinite(box.valueAsNumber) && write(box.valueAsNumber)});
    sync.push(() => { if (box !== box.getRootNode().activeElement) box.value = read() ?? ""; });
    return box;
  };
  const coordinates = [0, 1, 2].flatMap((k) => [make("span", {}, `${k + 1}`), ...[0, 1].map((axis) => {
    const i = () => state.triangles[chosen]?.[k];
    return number(() => state.vertices[i()]?.[axis], (value) => i() !== undefined && move(i(), state.vertices[i()].with(axis, value)),
      {"aria-label": `corner ${k + 1}, ${"xy"[axis]}`});
  })]);
  const title = make("h2");
  sync.push(() => { title.textContent = state.triangles.length ? `Triangle ${chosen} of ${state.triangles.length}` : "No triangle"; });
  const edit = Object.entries({add: "N", split: "P", flip: "R", remove: "Del", undo: "Z"}).map(([name, key]) => {
    const made = button(name, () => edits[name](), key);
    sync.push(() => { made.disabled = name === "undo" ? !past.length : name !== "add" && !state.triangles.length; });
    return made;
  });
  const plan = make("details", {ontoggle: explain}, make("summary", {}, "The plan, and why"), make("pre", {tabIndex: 0}));
  const size = [0, 1].map((axis) => number(() => state.size[axis], (value) => change({size: state.size.with(axis, Math.round(value))}),
    {min: 1, max: 256, step: 1, "aria-label": ["width", "height"][axis]}));
  const depth = choice("depth test", "depth_test", plain("less", "greater"));
  sync.push(() => { depth.hidden = (state.vertices[0]?.length ?? 2) < 3; });
  const save = async (kind) => {
    try {
      const {name, type, arrays} = await app.line.ask("pixels.export", {state, kind});
      download(name, arrays.content, type);
      app.say(`${name} is saved`);
    } catch (error) {
      app.say(error.message, true);
    }
  };
  const side = make("div.side", {},
    group("Scene", make("div.stepper", {},
      select("Scene", () => [...(scenes.includes(sceneName) ? [] : [["", app.hello.name || "from a link"]]), ...plain(...scenes)], () => scenes.includes(sceneName) ? sceneName : "", (name) => name && takeScene(name)),
      make("button", {type: "button", "aria-label": "previous scene", onclick: () => nextScene(-1)}, "‹"),
      make("button", {type: "button", "aria-label": "next scene", onclick: () => nextScene(1)}, "›"))),
    group("Methods", ...method("draws", "method"), ...method("beside it", "other", [["", "none"]]), check("the exact picture", "exact")),
    group("Rules",
      choice("sub-pixel bits", "subpixel_bits", plain(...[..."012345678", "10", "12", "14", "16", "exact"])),
      choice("sampling", "sampling", plain("center", "msaa2", "msaa4", "msaa8", "msaa16", "area", "outer", "inner")),
      choice("cull", "cull", plain("none", "back", "front")),
      choice("winding", "winding", plain("as given", "clockwise", "counter-clockwise")), depth),
    group("Shown", segments("Shown", ["owners", "overdraw", "wireframe"], () => state.look, (look) => change({look})),
      row("pixels", make("span.pair", {}, ...size))),
    make("section.group", {}, title, make("div.coordinates", {}, ...coordinates), make("div.buttons", {}, ...edit),
      row("drag to", select("Vertices are dragged to", plain("free", "sub-pixel", "pixel centre"), () => snap, (value) => { snap = value; }))),
    group("Keep", make("div.buttons", {}, ...["png", "svg", "code", "test"].map((kind) => button({png: "PNG", svg: "SVG", code: "Python", test: "Test case"}[kind], () => save(kind))),
      button("Copy link", () => app.copyLink()))),
  );
  const hint = make("p.hint", {}, ...KEYS.flatMap(([key, text], i) => [i ? " · " : "", make("kbd", {}, key), ` ${text}`]));
  panel.append(make("div.layout.three", {}, stage, why, side, make("div.below", {}, plan, hint)));
  new ResizeObserver(() => panel.hidden || !part.views.size || fit()).observe(stage);

  function enter() {
    if (!state.size) restore(app.hello.pixels);
  }
  return part;
}

// ---- Steps -----------------------------------------------------------------------------------------------------

function stepsPart(app, panel) {
  const part = {state: () => view, enter, restore}, view = {scene: "", method: "edge", subpixel_bits: 8, step: 0};
  let trace = null, scene = null, timer = null;
  const canvas = make("canvas"), over = svg("svg", {"aria-hidden": "true"}), values = make("dl.values"), about = make("p.hint");
  const told = make("p", {role: "status"}), play = button("Play", toggle, "Space");
  const slider = make("input", {type: "range", min: 0, "aria-label": "Step", oninput: () => go(slider.valueAsNumber)});
  const speed = make("input", {type: "range", min: 0, max: 3, step: 0.25, value: 1});

  function toggle() {
    const isOn = timer === null && trace;
    clearTimeout(timer);
    timer = null;
    play.textContent = isOn ? "Pause" : "Play";
    if (!isOn) return;
    if (view.step >= trace.steps.length) go(0);
    const tick = () => {
      if (view.step >= trace.steps.length || panel.hidden) return toggle();
      go(view.step + 1);
      timer = setTimeout(tick, 1000 / 10 ** speed.value);
    };
    timer = setTimeout(tick);
  }
  const back = () => go(view.step - 1), next = () => go(view.step + 1), first = () => go(0), last = () => go(Infinity);
  function leap(way) {
    const at = (k) => trace.steps[k - 1]?.slice(1, 4).filter((_, i) => i !== 1).join();
    let k = view.step + way;
    while (k > 0 && k < trace.steps.length && at(k) === at(view.step)) k += way;
    go(k);
  }
  function go(step) {
    if (!trace) return;
    view.step = Math.max(0, Math.min(trace.steps.length, step));
    const [width, height] = trace.size, pixels = new Uint8ClampedArray(4 * width * height), counts = new Uint32Array(width * height);
    for (const [kind, triangle, x, y, end, isDrawn] of trace.steps.slice(0, view.step)) {
      if (kind === "triangle" || kind === "row") continue;
      for (let i = y * width + x; i <= y * width + end; i++) {
        if (isDrawn) pixels.set(counts[i]++ ? [...TWICE, 255] : [...OWNERS[triangle % OWNERS.length], 255], 4 * i);
        else if (!counts[i]) pixels.set([128, 128, 128, 80], 4 * i);
      }
    }
    paint(canvas, Object.assign(pixels, {shape: [height, width, 4]}));
    const now = trace.steps[view.step - 1], [ox, oy] = scene.origin ?? [0, 0];
    over.setAttribute("viewBox", `0 0 ${width} ${height}`);
    over.parentNode.style.setProperty("--ratio", width / height);
    const corners = scene.triangles.map((row) => row.map((i) => `${scene.vertices[i][0] - ox},${scene.vertices[i][1] - oy}`).join(" "));
    over.replaceChildren(...["halo", "edges"].flatMap((name) => corners.map((points) => svg("polygon", {class: name, points}))),
    ...(now ? [svg("rect", {class: "now", x: now[2], y: now[3], width: now[4] - now[2] + 1, height: 1})] : []));
    slider.max = trace.steps.length;
    slider.value = view.step;
    tell(now);
    app.keep();
  }
  function tell(now) {
    values.replaceChildren();
    if (!now) return void (told.textContent = `${trace.steps.length} steps. Nothing is drawn yet.`);
    const [kind, triangle, x, y, end, isDrawn, numbers] = now;
    told.textContent = `${view.step} of ${trace.steps.length}. ` + {
      triangle: `Triangle ${triangle} is set up.`, row: `Row ${y} of triangle ${triangle}.`,
      line: `The ${numbers.side} line passes pixel ${x}, ${y}.`, span: `Pixels ${x} to ${end} of row ${y} are drawn.`,
      test: `Pixel ${x}, ${y} of triangle ${triangle}: ${isDrawn ? "drawn" : numbers.is_inside ? "inside" : "outside"}.`,
    }[kind];
    const before = trace.steps.slice(0, view.step - 1).findLast((one) => one[0] === kind && one[1] === triangle)?.[6] ?? {};
    for (const [name, value] of Object.entries(numbers)) {
      const change = typeof value === "number" ? value - before[name] : NaN;
      values.append(make("dt", {}, name), make(value < 0 ? "dd.bad" : "dd", {}, JSON.stringify(value).replaceAll('"', "")),
        make("dd.change", {}, Number.isNaN(change) ? "" : `${change < 0 ? "−" : "+"}${+Math.abs(change).toPrecision(6)}`));
    }
  }
  const record = newest(async () => {
    try {
      scene = view.scene ? (await app.line.ask("pixels.scene", {name: view.scene})).state : pixelsScene();
      const {vertices, triangles, size, origin} = scene, {method, subpixel_bits} = view;
      trace = await app.line.ask("steps.trace", {vertices, triangles, size, origin, method, subpixel_bits});
      methods.replaceChildren(...trace.methods.map((name) => make("option", {value: name}, name)));
      methods.value = method;
      about.textContent = `${trace.summary}. ${trace.source}.`;
      app.say("");
      go(view.step);
    } catch (error) {
      app.say(error.message, true);
    }
  });
  const pixelsScene = () => (app.parts.pixels.scene().size ? app.parts.pixels.scene() : app.hello.pixels);
  const set = (name, read = String) => (value) => (Object.assign(view, {[name]: read(value), step: 0}), record());
  const scenes = choose("scene", [["", "that of Pixels"], ...app.hello.scenes.map((name) => [name, name])], "", set("scene"));
  const chosen = choose("method", [["edge", "edge"]], "edge", set("method")), methods = chosen.lastChild;
  const bits = choose("sub-pixel bits", [0, 1, 2, 4, 8, 12, 16].map((n) => [n, n]), 8, set("subpixel_bits", Number));
  const keys = {" ": toggle, ArrowRight: next, ArrowLeft: back, Home: first, End: last};
  panel.append(make("div.layout", {tabIndex: -1, onkeydown(event) {
    const isBusy = /SELECT|INPUT/.test(event.target.tagName) || (event.key === " " && event.target.tagName === "BUTTON");
    const act = event.shiftKey && event.key.startsWith("Arrow") ? () => leap(event.key === "ArrowRight" ? 1 : -1) : keys[event.key];
    if (act && trace && !isBusy) event.preventDefault(), act();
  }}, make("div.stage", {}, make("div.magnified", {}, canvas, over)), make("div.side", {},
    group("Steps", make("div.buttons", {}, play, button("Back", back, "Left"), button("Step", next, "Right"), button("Row back", () => leap(-1), "Shift and left"),
      button("Row", () => leap(1), "Shift and right"), button("First", first, "Home"), button("Last", last, "End")), slider, row("speed", speed)),
    group("Now", told, values), group("Drawn", scenes, chosen, bits, about))));
  function enter() {
    if (!view.scene || !trace) record();
  }
  function restore(given) {
    Object.assign(view, given);
    [scenes.lastChild.value, bits.lastChild.value] = [view.scene, view.subpixel_bits];
    record();
  }
  return part;
}

// ---- Mesh ------------------------------------------------------------------------------------------------------

function meshPart(app, panel) {
  const home = () => ({azimuth: 35, elevation: 20, zoom: 1, pan: [0, 0]});
  const view = {...home(), fov: 40, up: "y", layer: "smooth", lights: "headlight", edges: false, sampling: "center", tolerance: 0, cull: "none"};
  const frames = {painted: 0, asked: 0, newest: 0, times: [], last: null, waiting: null, rest: 0};
  const part = {state: () => view, enter, restore, view, frames, change, spin: 0};
  const canvas = make("canvas", {tabIndex: 0, role: "img", "aria-label": "The mesh: arrows turn it, with Shift they move it, plus and minus zoom"});
  const over = svg("svg", {"aria-hidden": "true"}), stage = make("div.stage.mesh", {}, canvas, over), side = make("div.side");
  const facts = make("p", {}, "No mesh yet."), rate = make("p.hint"), found = make("dl.values"), legend = make("div.legend");
  const planText = make("pre", {tabIndex: 0}), planBox = make("details", {ontoggle: () => plan()}, make("summary", {}, "The plan, and why"), planText);
  const file = make("input", {type: "file", "aria-label": "A mesh file", onchange: () => open(file.files[0])});
  let mesh = null;

  const size = () => [stage.clientWidth, stage.clientHeight].map((n) => Math.max(1, Math.round(n * Math.min(devicePixelRatio, 2))));
  const ask = (name, more) => app.line.ask(`mesh.${name}`, {...view, size: size(), ...more}).catch((error) => void app.say(error.message, true));
  const paper = () => getComputedStyle(app.root).backgroundColor.match(/\d+/g).slice(0, 3).map(Number);
  // A view that changes comes as a JPEG, with the colour of the page behind it, and once more as it is when it rests. The
  // next frame is asked for before this one is on the screen: Python draws while the browser decodes and paints.
  const draw = newest(async (isAtRest = false) => {
    clearTimeout(frames.rest);
    const start = performance.now(), number = ++frames.asked;
    const frame = await ask("draw", isAtRest ? {} : {background: paper()});
    if (frame) frame.took = performance.now() - start, decode(frame, number, isAtRest);
    if (part.spin && !panel.hidden) view.azimuth = (view.azimuth + part.spin) % 360, draw();
    else if (frame && !isAtRest) frames.rest = setTimeout(() => draw(true), 200);
  });
  async function decode(frame, number, isAtRest) {
    const [, , width, height] = frame.box, {pixels} = frame.arrays, start = performance.now();
    if (pixels.length) frame.image = isAtRest ? new ImageData(pixels, width, height) : await createImageBitmap(new Blob([pixels]));
    frame.decode = performance.now() - start;
    if (number < frames.newest) return;
    frames.newest = number;
    if (!frames.waiting) requestAnimationFrame(show);
    frames.waiting = frame;
  }
  function show() {
    const frame = frames.waiting, [x, y] = frame.box, start = performance.now(), context = canvas.getContext("2d");
    frames.waiting = null;
    [canvas.width, canvas.height] = frame.size;
    if (frame.image instanceof ImageData) context.putImageData(frame.image, x, y);
    else if (frame.image) context.drawImage(frame.image, x, y);
    frames.painted++, frames.last = frame, frame.paint = performance.now() - start;
    frames.times = [...frames.times.filter((time) => start - time < 1000), start];
    const level = frame.level === undefined ? "" : `; level ${frame.level}, ${frame.level_triangles.toLocaleString("en")} triangles`;
    rate.textContent = `${frames.times.length} frames in a second; drawn in ${frame.draw_ms.toFixed(1)} ms, here after ${frame.took.toFixed(1)} ms${level}`;
  }
  function change(values) {
    Object.assign(view, values);
    view.elevation = Math.max(-90, Math.min(90, view.elevation));
    view.zoom = Math.max(0.05, Math.min(1000, view.zoom));
    over.replaceChildren();
    legend.replaceChildren(...(view.layer === "overdraw" ? mesh?.heat ?? [] : []).map(([rgb, text]) => make("span", {}, make("i", {style: `background:rgb(${rgb})`}), text)));
    if (mesh) draw(), plan();
    app.keep();
  }
  const plan = newest(async () => {
    if (planBox.open) planText.textContent = (await ask("plan"))?.text ?? "";
  });

  async function pick({clientX, clientY}) {
    const {left, top, width} = canvas.getBoundingClientRect(), scale = canvas.width / width, size = [canvas.width, canvas.height];
    const [x, y] = [clientX - left, clientY - top].map((at) => Math.floor(at * scale)), hit = await ask("pick", {size, x, y});
    if (!hit) return;
    const short = (numbers) => numbers.map((number) => +number.toPrecision(5)).join(", ");
    const rows = hit.triangle < 0 ? [["shows", "nothing"]] : [
      [hit.is_level ? "triangle of the level" : "triangle", hit.triangle], ["vertices", hit.vertices.join(", ")],
      ...hit.positions.map((at, k) => [`at ${k}`, short(at)]), ["weights", short(hit.barycentric)], ["depth", short([hit.depth])],
      ...(hit.uv ? [["uv", short(hit.uv)]] : []), ...(hit.material ? [["material", hit.material]] : [])];
    found.replaceChildren(...[["pixel", `${x}, ${y}`], ...rows].flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, `${value}`)]));
    over.setAttribute("viewBox", `0 0 ${size.join(" ")}`);
    over.replaceChildren(...(hit.corners_px ? ["halo", "taken"].map((name) => svg("polygon", {class: name, points: hit.corners_px.join(" ")})) : []));
  }
  async function open(given) {
    if (given) app.say(`Reading ${given.name}`);
    try {
      mesh = await app.line.ask("mesh.open", {name: given?.name}, given ? [new Uint8Array(await given.arrayBuffer())] : []);
    } catch (error) {
      return void app.say(error.message, true);
    }
    facts.textContent = `${mesh.name}: ${mesh.n_triangles.toLocaleString("en")} triangles, ${mesh.n_vertices.toLocaleString("en")} vertices`;
    app.say(mesh.lacks.join("; "));
    if (!mesh.layers.includes(view.layer)) view.layer = "smooth";
    controls();
    change(given ? home() : {});
  }
  async function save(what) {
    const {name, arrays} = (await ask("save", {what})) ?? {};
    if (name) download(name, arrays.file);
  }

  // One finger or button turns, the other button, Shift or two fingers move, two fingers and the wheel zoom.
  const pointers = new Map();
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, moved: 0, button: event.button});
  };
  canvas.onpointermove = (event) => {
    const old = pointers.get(event.pointerId), before = [...pointers.values()], reach = ([a, b]) => Math.hypot(a.x - b.x, a.y - b.y) || 1;
    if (!old) return;
    const dx = event.clientX - old.x, dy = event.clientY - old.y, share = (pointers.size > 1 ? 1 : 2) / canvas.clientHeight;
    pointers.set(event.pointerId, {...old, x: event.clientX, y: event.clientY, moved: old.moved + Math.abs(dx) + Math.abs(dy)});
    const pan = [view.pan[0] + share * dx, view.pan[1] - share * dy];
    if (pointers.size === 2) change({pan, zoom: view.zoom * reach([...pointers.values()]) / reach(before)});
    else if (old.button || event.shiftKey) change({pan});
    else change({azimuth: view.azimuth - 0.4 * dx, elevation: view.elevation + 0.4 * dy});
  };
  canvas.onpointerup = canvas.onpointercancel = (event) => {
    const old = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (event.type === "pointerup" && old?.moved < 4 && !old.button) pick(event);
  };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => (event.preventDefault(), change({zoom: view.zoom * 1.0015 ** -event.deltaY})), {passive: false});
  canvas.onkeydown = (event) => {
    const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key] ?? [0, 0];
    const zoom = {"+": 1.1, "=": 1.1, "-": 1 / 1.1}[event.key];
    if (x || y) change(event.shiftKey ? {pan: [view.pan[0] + 0.05 * x, view.pan[1] + 0.05 * y]} : {azimuth: view.azimuth + 5 * x, elevation: view.elevation + 5 * y});
    else if (zoom || event.key === "0") change(zoom ? {zoom: view.zoom * zoom} : home());
    else return;
    event.preventDefault();
  };
  panel.ondragover = (event) => event.preventDefault();
  panel.ondrop = (event) => (event.preventDefault(), event.dataTransfer.files[0] && open(event.dataTransfer.files[0]));

  function controls() {
    const choice = (label, name, options) => choose(label, options.map((one) => [one].flat()), view[name], (text) =>
      change({[name]: typeof view[name] === "number" ? Number(text) : text}));
    const check = (label, isOn, act) => {
      const box = make("input", {type: "checkbox", checked: isOn, onchange: () => act(box.checked)});
      return make("label.check", {}, box, label);
    };
    side.replaceChildren(group("Mesh", facts, file, rate), ...(mesh ? [
      group("Look", choice("layer", "layer", mesh.layers), legend, choice("light", "lights", mesh.lights), choice("sampling", "sampling", ["center", "msaa2", "msaa4", "msaa8", "msaa16"]),
        choice("tolerance", "tolerance", [[0, "none: the mesh itself"], ...[0.25, 0.5, 1, 2, 4].map((n) => [n, `${n} px: a coarser level`])]),
        choice("cull", "cull", ["none", "back", "front"]), check("wireframe", view.edges, (edges) => change({edges}))),
      group("Camera", choice("view angle", "fov", [[40, "40°"], [20, "20°"], [70, "70°"], [0, "no perspective"]]), choice("up", "up", ["y", "z"]),
        check("turn by itself", part.spin, (isOn) => (part.spin = isOn ? 1.5 : 0, draw())), make("div.buttons", {}, button("Reset", () => change(home()), "0"))),
      group("Picked", make("p.hint", {}, "A click tells which triangle shows."), found),
      group("Keep", make("div.buttons", {}, ...[["PNG", "png"], ["Python", "code"], ["Job file", "job"]].map(([text, what]) => button(text, () => save(what))),
        button("Copy link", () => app.copyLink())), planBox)] : [make("p.hint", {}, "Drop a file here: OBJ, PLY, STL, OFF, glTF or GLB.")]));
  }
  controls();
  panel.append(make("div.layout", {}, stage, side));
  new ResizeObserver(() => mesh && !panel.hidden && draw()).observe(stage);
  function enter() {
    if (mesh) draw();
    else open();
  }
  function restore(given) {
    for (const name of Object.keys(view)) if (name in given) view[name] = given[name];
    controls();
    change({});
  }
  return part;
}

// ---- Race ------------------------------------------------------------------------------------------------------

function racePart(app, panel) {
  const view = {family: "fan", positions: [3], seed: 0}, part = {state: () => view, enter, restore, drawn: 0};
  const faultColors = [null, OWNERS[3], TWICE, [20, 130, 210]], shareColors = ["#ffffcc", "#c7e9b4", "#7fcdbb", "#41b6c4", "#2c7fb8", "#253494"];
  const stage = make("div.stage.race"), sliders = make("div"), what = make("p"), chart = make("table.chart"), by = make("p.hint"), side = make("div.side");
  let known = null, racers = [], mapped = "";

  const draw = newest(async () => {
    const told = await app.line.ask("race.draw", view).catch((error) => void app.say(error.message, true));
    if (!told) return;
    const [width, height] = told.size, n = width * height, {triangle, faults} = told.arrays;
    sliders.querySelectorAll("output").forEach((output, i) => (output.textContent = told.values[i]));
    told.methods.forEach(({bad, gaps, overdrawn, refused}, k) => {
      const pixels = new Uint8ClampedArray(4 * n);
      for (let i = 0; i < n; i++) {
        const fault = faultColors[faults[k * n + i]];
        pixels.set(fault ? [...fault, 255] : [128, 128, 128, refused || triangle[i] < 0 ? 0 : 40 + 30 * (triangle[i] % 3)], 4 * i);
      }
      paint(racers[k].canvas, Object.assign(pixels, {shape: [height, width, 4]}));
      Object.assign(racers[k].count, {textContent: refused ? "refuses" : bad ? `${bad} wrong` : "right", className: bad ? "bad" : "good"});
      racers[k].title = refused ?? `${bad} of ${n} pixels: ${gaps} gaps, ${overdrawn} drawn more than once`;
    });
    app.say("");
    part.drawn++;
    for (const line of chart.rows) [...line.cells].forEach((cell, i) => cell.classList.toggle("here", i === Math.round(view.positions.at(-1)) + 1));
  });
  // The chart is filled column by column; another family, seed or first parameter begins another.
  async function map() {
    const {axes} = known.families[view.family], axis = axes.at(-1), others = view.positions.slice(0, -1);
    const wanted = JSON.stringify([view.family, view.seed, others]);
    if (mapped === wanted) return;
    mapped = wanted;
    by.textContent = `Wrong pixels, in % of those that an edge meets, by ${axis.what}. A dot: with gaps.`;
    chart.replaceChildren(make("thead", {}, make("tr", {}, make("th"), ...axis.steps.map((step, i) => make("th", {scope: "col"}, button(step, () => set(axes.length - 1, i)))))),
      make("tbody", {}, ...known.methods.map((name) => make("tr", {}, make("th", {scope: "row"}, name), ...axis.steps.map(() => make("td"))))));
    for (let i = 0; i < axis.steps.length; i++) {
      const column = await app.line.ask("race.column", {...view, positions: [...others, i]}).catch(() => null);
      if (mapped !== wanted || !column) return;
      column.rows.forEach(([bad, hasGaps], k) => {
        const cell = chart.tBodies[0].rows[k].cells[i + 1], share = bad / Math.max(1, column.n_edge_px);
        const level = Math.max(0, Math.min(5, Math.floor(1.5 * Math.log10(share) + 6)));
        cell.title = bad === null ? "refuses to draw" : `${bad} wrong pixels${hasGaps ? ", with gaps" : ""}`;
        cell.classList.add(bad === null ? "refused" : level > 3 ? "dark" : "light", ...(hasGaps ? ["gaps"] : []));
        if (bad) cell.textContent = share < 0.01 ? (100 * share).toFixed(1) : Math.round(100 * share), cell.style.background = shareColors[level];
      });
    }
  }
  function set(i, position) {
    view.positions[i] = position;
    sliders.querySelectorAll("input")[i].value = position;
    draw(), map(), app.keep();
  }
  function take(family) {
    const {axes, what: text} = known.families[family];
    if (family !== view.family || view.positions.length !== axes.length) view.positions = axes.map(() => 0);
    view.family = family;
    what.textContent = `${text[0].toUpperCase()}${text.slice(1)}. Each pixel has to be drawn once.`;
    sliders.replaceChildren(...axes.map((axis, i) => make("label.slider", {}, make("span", {}, `${axis.what}: `, make("output")), make("input", {
      type: "range", min: 0, max: axis.steps.length - 1, step: axis.is_continuous ? 0.05 : 1, value: view.positions[i], oninput: ({target}) => set(i, target.valueAsNumber),
    }))));
    draw(), map(), app.keep();
  }
  async function enter() {
    if (panel.firstChild) return;
    panel.append(make("div.layout.wide", {}, stage, side, group("Chart", by, make("div.scroll", {tabIndex: 0}, chart))));
    known = await app.line.ask("race.families");
    racers = known.methods.map((name) => {
      const canvas = make("canvas"), count = make("span");
      return Object.assign(make("figure", {}, canvas, make("figcaption", {}, name.replace(/[_/]/g, "$&\u200b"), count)), {canvas, count});
    });
    stage.append(...racers);
    build();
  }
  function build() {
    const seed = make("input", {type: "number", min: 0, max: 99, value: view.seed, onchange: () => (view.seed = Math.max(0, seed.valueAsNumber | 0), draw(), map(), app.keep())});
    const key = ["another triangle shows", "a gap", "drawn more than once"].map((text, i) => make("span", {}, make("i", {style: `background:rgb(${faultColors[i + 1]})`}), text));
    side.replaceChildren(group("Race", choose("family", Object.keys(known.families).map((name) => [name, name]), view.family, take), what, sliders, row("seed", seed),
      make("div.legend", {}, ...key)));
    take(view.family);
  }
  function restore(given) {
    Object.assign(view, given);
    if (racers.length) build();
  }
  return part;
}

// ---- the page --------------------------------------------------------------------------------------------------

// Fills an .explorer element with its parts. `app` is what they share: app.line.ask, app.say (a line of status),
// app.hello (what Python begins with), app.root, app.show(tab), app.parts, app.keep (notes the state in the address).
export async function start(root, connect, hasAddress = true) {
  const app = {root, parts: {}, tab: null};
  const tabs = [...root.querySelectorAll("[data-tab]")];
  app.say = (text, isBad = false) => {
    const status = root.querySelector(".status");
    status.textContent = text;
    status.classList.toggle("bad", isBad);
  };
  app.show = (name) => {
    app.tab = name;
    for (const tab of tabs) {
      const isShown = tab.dataset.tab === name;
      tab.setAttribute("aria-selected", isShown);
      tab.tabIndex = isShown ? 0 : -1;
      root.querySelector(`[data-panel=${tab.dataset.tab}]`).hidden = !isShown;
    }
    app.parts[name].enter();
    app.keep();
  };

  // The address holds what is shown: #pixels={...}.
  let noted = "", timer = 0;
  app.keep = () => {
    clearTimeout(timer);
    timer = setTimeout(() => {
      const text = JSON.stringify(app.parts[app.tab].state?.() ?? {});
      noted = `#${app.tab}=${encodeURIComponent(text)}`;
      if (hasAddress && noted.length < 60000) history.replaceState(null, "", noted);
    }, 200);
  };
  app.copyLink = async () => {
    const link = hasAddress ? location.href : noted;
    try {
      await navigator.clipboard.writeText(link);
      app.say("The link is copied.");
    } catch {
      app.say(link);
    }
  };
  app.restore = (fragment) => {
    const [tab, text = ""] = fragment.replace(/^#/, "").split("=");
    if (!(tab in PARTS) || !text) return false;
    app.show(tab);
    try {
      app.parts[tab].restore?.(JSON.parse(decodeURIComponent(text)));
    } catch (error) {
      app.say(`This link cannot be read: ${error.message}`, true);
    }
    return true;
  };

  try {
    app.line = await connect(() => app.say("The explorer has ended. Start it again to go on.", true));
    app.hello = await app.line.ask("hello");
  } catch (error) {
    return void app.say(error.message, true);
  }
  for (const [name, part] of Object.entries(PARTS)) {
    app.parts[name] = part(app, root.querySelector(`[data-panel=${name}]`));
  }
  for (const [i, tab] of tabs.entries()) {
    tab.onclick = () => app.show(tab.dataset.tab);
    tab.onkeydown = ({key}) => {
      const next = tabs.at((i + ({ArrowRight: 1, ArrowLeft: -1}[key] ?? tabs.length)) % tabs.length);
      if (next !== tab) next.focus(), app.show(next.dataset.tab);
    };
  }
  root.app = app;
  if (hasAddress) addEventListener("hashchange", () => location.hash !== noted && app.restore(location.hash));
  if (!app.restore(hasAddress && location.hash ? location.hash : app.hello.fragment)) app.show(app.hello.tab);
  return app;
}

// In a notebook: anywidget calls this for each cell.
async function render({model, el}) {
  el.innerHTML = model.get("markup");
  await start(el.querySelector(".explorer"), () => notebookLine(model), false);
}
export default {render};

const page = document.querySelector("body > .explorer");
if (page) start(page, socketLine);
