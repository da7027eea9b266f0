// The page of the explorer. It asks for everything that is drawn, and draws no triangle by itself: pictures are arrays of
// pixels that come from the library, by Python or, in a page that was written with --export, by a worker with the same
// kernels; lines and handles are laid over them.

// ---- questions and answers -------------------------------------------------------------------------------------

const ARRAYS = {
  uint8: Uint8ClampedArray, int32: Int32Array, float32: Float32Array, float64: Float64Array, uint16: Uint16Array,
  int64: BigInt64Array, uint32: Uint32Array, int16: Int16Array,
};

// Typed arrays, with their shape, in place of their descriptions in a header.
function withArrays(header, parts) {
  for (const [name, {dtype, shape, part}] of Object.entries(header.arrays ?? {})) {
    let {buffer, byteOffset, byteLength} = parts[part];
    if (byteOffset % 8) [buffer, byteOffset] = [buffer.slice(byteOffset, byteOffset + byteLength), 0];  // of a notebook
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
  lose(why = "the connection is closed") {
    for (const {reject} of this.waiting.values()) reject(new Error(why));
    this.waiting.clear();
    this.onLost?.();
  }
}

// A WebSocket; where none is let through, POST.
function socketLine(onLost) {
  const socket = new WebSocket(new URL("socket", document.baseURI).href.replace(/^http/, "ws").replace(/#.*/, ""));
  socket.binaryType = "arraybuffer";
  const line = new Line((header, parts) => socket.send(pack(header, parts)), onLost);
  socket.onmessage = ({data}) => line.hear(unpack(data));
  return new Promise((resolve, reject) => {
    const fallBack = () => {
      clearTimeout(late);
      socket.onopen = socket.onerror = null;
      socket.close();
      fetch(document.baseURI).then(() => resolve(postLine(onLost)), () => reject(new Error("the explorer has ended: start it again")));
    };
    const late = setTimeout(fallBack, 4000);
    socket.onerror = fallBack;
    socket.onopen = () => {
      clearTimeout(late);
      socket.onclose = () => line.lose();
      resolve(line);
    };
  });
}

// The same frames, a POST each, one after the other. It asks every 20 s, or it would be taken for closed.
function postLine(onLost) {
  const page = crypto.getRandomValues(new Uint32Array(4)).join("-"), url = new URL(`ask/${page}`, document.baseURI);
  let last = Promise.resolve();
  const post = async (frame) => {
    const answer = await fetch(url, {method: "POST", body: frame});
    if (!answer.ok) throw new Error((await answer.text()).trim());
    line.hear(unpack(await answer.arrayBuffer()));
  };
  const line = new Line((header, parts) => {
    const frame = pack(header, parts);
    last = last.then(() => post(frame)).catch(({message}) => (clearInterval(alive), line.lose(message)));
  }, onLost);
  const alive = setInterval(() => line.ask("hello").catch(() => {}), 20000);
  line.note = "WebSocket is blocked by a proxy or an extension: the page asks by HTTP, which takes longer.";
  return line;
}

// A page without Python: a worker answers.
async function workerLine(onLost, root) {
  const worker = new Worker(new URL(root.dataset.worker, document.baseURI), {type: "module"});
  const line = new Line((header, parts) => worker.postMessage([header, parts], parts.map((part) => part.buffer)), onLost);
  worker.onmessage = ({data: [header, parts]}) => line.hear(withArrays(header, parts));
  worker.onerror = (event) => (event.preventDefault?.(), line.lose(event.message));
  return line;
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

// The scenes that Python lists, in their groups, with what they show.
const sceneOptions = (app) => app.hello.groups.map(([label, rows]) =>
  make("optgroup", {label}, ...rows.map(([name, title]) => make("option", {value: name, title}, name))));

// A key of colours: [text, [r, g, b]] each.
const keyOf = (rows) => rows.map(([text, rgb]) => make("span", {}, make("i", {style: `background:rgb(${rgb})`}), text));

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
const MOVES = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
  a: [-1, 0], d: [1, 0], w: [0, -1], s: [0, 1],
};
const EDIT_KEYS = {n: "add", p: "split", r: "flip", Delete: "remove", z: "undo", "]": "forward", "[": "back"};

// A state is what Python draws: vertices, triangles, a window, methods and rules (PixelState in state.py).
function pixelsPart(app, panel) {
  const part = {state: () => state, scene: () => state, drawn: null, enter, restore, views: new Map()};
  const find = (what) => panel.querySelector(what), findAll = (what) => [...panel.querySelectorAll(what)];
  const stage = find(".stage"), panels = find(".panels"), why = find(".why"), plan = find(".plan");
  const boxes = findAll("[data-name]"), {methods, scenes} = app.hello;
  let state = {}, chosen = 0, corner = null;  // the triangle that is edited, and its corner that the keys move
  let pixel = null, sample = 0, probed = "a", samples = [], past = [], fitted = "", isRefused = false;
  let hasEdges = true, whole = {};  // the window that the scene began with
  const aboutScene = new Map(app.hello.groups.flatMap(([, rows]) => rows));

  // -- what is asked --

  const told = (error) => app.say(error.message, true);
  const redraw = newest(async () => {
    const asked = state;
    try {
      show(await app.line.ask("pixels.draw", {state: asked}));
      if (isRefused) app.say("");
      isRefused = false;
    } catch (error) {
      isRefused = true;
      told(error);
    }
    part.drawn = asked;
    if (app.root.classList.contains("figure")) parent.postMessage("topleft is drawn", "*");
    part.onDrawn?.();
  });
  const explain = newest(async () => {
    if (plan.open) plan.lastChild.textContent = (await app.line.ask("pixels.plan", {state}).catch(told))?.text ?? "";
  });
  const look = newest(async () => {
    const method = {b: state.other, exact: "exact"}[probed] || state.method;
    if (pixel) tell(await app.line.ask("pixels.probe", {state, pixel, sample, method}).catch(({message}) => ({sentences: [message]})));
  });

  // Every change goes through here: `remember` lets Z take it back.
  function change(next, remember = true) {
    if (remember) past = [...past.slice(-199), state];
    state = {...state, ...next};
    if (pixel?.some((at, k) => at >= state.size[k])) pixel = null;
    if ("sampling" in next) sample = 0;
    chosen = Math.max(0, Math.min(chosen, state.triangles.length - 1));
    overlay(), controls(), redraw(), look(), explain(), app.keep();
  }
  function restore(given) {
    [past, corner, chosen] = [[], null, 0];
    [pixel, probed] = [given.size.map((n) => n >> 1), given.other ? "b" : "a"];
    whole = {size: given.size, origin: given.origin ?? [0, 0]};
    change({...PIXEL_DEFAULTS, ...given}, false);
  }
  async function takeScene(name) {
    const before = state, {state: scene} = await app.line.ask("pixels.scene", {name});
    const {method, other, exact, look} = before, kept = "exact" in scene ? {} : {method, other, exact, look};
    restore({...kept, ...scene, scene: name});
    past = [before];
    app.say(name);
  }
  const nextScene = (step) => takeScene(scenes.at((Math.max(0, scenes.indexOf(state.scene)) + step) % scenes.length));

  // -- the window --

  // Shows `factor` times as much round a place of the picture, which stays where it is; Python draws it anew.
  const MOST_SIDE = 256, LEAST_SIDE = 4;
  function zoom(factor, [x, y] = state.size.map((n, k) => state.origin[k] + n / 2)) {
    const size = state.size.map((n) => Math.max(LEAST_SIDE, Math.min(MOST_SIDE, Math.round(n * factor))));
    see(size, [x, y].map((at, k) => Math.round(at - (at - state.origin[k]) * size[k] / state.size[k])));
  }
  function see(size, origin) {
    pixel = pixel?.map((at, k) => at + state.origin[k] - origin[k]);
    if (pixel?.some((at, k) => at < 0 || at >= size[k])) pixel = null;
    change({size, origin}, false);
  }

  // -- triangles --

  const step = () => 2 ** -(state.subpixel_bits === "exact" ? 8 : state.subpixel_bits);
  function snapped(x) {
    const kind = find(".snap").value, grid = kind === "free" ? 2 ** -20 : step();
    return kind === "pixel centre" ? Math.floor(x) + 0.5 : Math.round(x / grid) * grid;
  }
  const taken = () => state.triangles[chosen] ?? [];
  const move = (i, [x, y], remember) =>
    change({vertices: state.vertices.map((row, k) => k === i ? [x, y, ...row.slice(2)] : row)}, remember);
  async function edit(what) {
    const n = state.triangles.length;
    if (what === "undo") {
      if (past.length) state = past.pop(), change({}, false);
    } else if (what === "next" || what === "previous") await nextScene(what === "next" ? 1 : -1);
    else if (what === "forward" || what === "back") chosen = (chosen + (what === "forward" ? 1 : n - 1)) % Math.max(1, n);
    else {
      const made = await app.line.ask("pixels.edit", {state, triangle: chosen, what});
      [corner, chosen] = [null, made.triangle];
      change(made.state);
    }
    overlay(), controls();
  }

  // -- the pictures --

  function show({panels: shown, arrays, samples: at}) {
    const isNew = samples.length !== at.length;
    samples = at;
    for (const [key, {figure}] of part.views) {
      if (!shown.some((one) => one.key === key)) figure.remove(), part.views.delete(key);
    }
    for (const {key, title, notes, facts, legend, refused} of shown) {
      if (!part.views.has(key)) part.views.set(key, view(key));
      const one = part.views.get(key), text = facts.map(([words, kind, title = ""]) => make(`span.${kind}`, {title}, words));
      Object.assign(one, {owners: arrays[`${key}_owners`], counts: arrays[`${key}_counts`]});
      one.caption.replaceChildren(make("b", {}, title), make("span", {}, notes), make("div", {}, text));
      one.legend.replaceChildren(...legend.map(([color, words]) =>
        make("span", {}, make("i", {style: `background:${color}`}), words)), make("span.bad", {}, refused));
      one.box.hidden = !arrays[key];
      if (arrays[key]) paint(one.canvas, arrays[key]);
      panels.append(one.figure);
    }
    const wanted = JSON.stringify([shown.map(({key}) => key), state.size]);
    if (wanted !== fitted) fitted = wanted, fit();
    else if (state.look === "overdraw" || isNew) overlay();
  }

  // A picture with its caption, the lines over it, and what a pointer does there.
  function view(key) {
    const canvas = make("canvas"), sheet = svg("svg", {"aria-hidden": "true"});
    const box = make("div.view", {}, canvas, sheet), caption = make("figcaption"), legend = make("div.legend");
    const figure = make("figure.panel", {"data-key": key}, caption, box, legend);
    let dragged = null, grabbed = null;
    const touches = new Map(), span = () => {
      const [a, b] = [...touches.values()];
      return {reach: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY) || 1,
        middle: place({clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2})};
    };
    const place = ({clientX, clientY}) => {
      const {left, top} = sheet.getBoundingClientRect();
      return [clientX - left, clientY - top].map((value, k) => value / part.cell - 1 + state.origin[k]);
    };
    const nearest = (event) => {
      const [x, y] = place(event), reach = (event.pointerType === "touch" ? 26 : 13) / part.cell;
      const far = state.vertices.map((v) => Math.hypot(v[0] - x, v[1] - y)), own = taken()[corner];
      const i = far[own] <= reach ? own : far.indexOf(Math.min(...far));
      return far[i] <= reach ? i : null;
    };
    const at = (event) => place(event).map((value, k) => Math.floor(value - state.origin[k]));
    const nearestSample = (event) => {
      const [x, y] = place(event).map((value) => value - Math.floor(value));
      const far = samples.map((one) => Math.hypot(one[0] - x, one[1] - y));
      return Math.max(0, far.indexOf(Math.min(...far)));
    };
    const isInside = (at) => at.every((value, k) => value >= 0 && value < state.size[k]);
    sheet.onwheel = (event) => {
      event.preventDefault();
      zoom(1.0015 ** Math.max(-300, Math.min(300, event.deltaY)), place(event));
    };
    sheet.onpointerdown = (event) => {
      touches.set(event.pointerId, event);
      if (touches.size === 2) return void (dragged = null, grabbed = span());
      if (event.button || event.shiftKey) {
        sheet.setPointerCapture(event.pointerId);
        return void (grabbed = {middle: place(event)});
      }
      stage.focus({preventScroll: true});
      dragged = nearest(event);
      const [x, y] = at(event);
      if (dragged !== null) {
        if (!taken().includes(dragged)) chosen = Math.max(0, state.triangles.findIndex((row) => row.includes(dragged)));
        corner = taken().indexOf(dragged);
        past = [...past.slice(-199), state];
        sheet.setPointerCapture(event.pointerId);
      } else if (isInside([x, y])) {
        const owner = part.views.get(key).owners?.[y * state.size[0] + x] ?? -1;
        if (owner >= 0) chosen = owner;
        inspect([x, y], key, nearestSample(event));
      }
      overlay(), controls();
    };
    sheet.onpointermove = (event) => {
      if (touches.has(event.pointerId)) touches.set(event.pointerId, event);
      if (grabbed) {
        const {reach, middle} = touches.size === 2 ? span() : {middle: place(event)}, factor = reach ? grabbed.reach / reach : 1;
        const origin = state.origin.map((at, k) => at + Math.round(grabbed.middle[k] - middle[k]));
        if (Math.abs(Math.log(factor)) > 0.1) zoom(factor, middle), grabbed = {...grabbed, reach};
        else if (`${origin}` !== `${state.origin}`) see(state.size, origin);
        return;
      }
      if (dragged !== null) move(dragged, place(event).map(snapped), false);
      else if (event.pointerType === "mouse" && isInside(at(event))) inspect(at(event), key, nearestSample(event));
    };
    sheet.onpointerup = sheet.onpointercancel = (event) => {
      touches.delete(event.pointerId);
      [dragged, grabbed] = [null, null];
    };
    sheet.oncontextmenu = (event) => event.preventDefault();
    return {figure, canvas, sheet, box, caption, legend};
  }
  function inspect(at, key = probed, k = 0) {
    if (`${pixel},${sample}` === `${at},${k}` && probed === key) return;
    [pixel, probed, sample] = [at, key, k];
    look();
    for (const {sheet} of part.views.values()) ring(sheet.querySelector(".ring"));
  }
  function ring(rect) {
    const [x, y] = pixel ?? [0, 0], width = pixel ? 1 : 0;
    for (const [name, value] of Object.entries({x, y, width, height: 1})) rect?.setAttribute(name, value);
  }

  // The largest whole number of screen pixels a pixel that lets all pictures fit, in the columns that allow most; below
  // LEAST_CELL they may be higher than the window, which then scrolls.
  const LEAST_CELL = 6;
  function fit() {
    const n = part.views.size, [width, height] = state.size, isNarrow = stage.clientWidth < 480;
    const room = Math.max(420, innerHeight - 120), most = isNarrow ? 1 : n;
    const cellOf = (columns, room) => {
      const wide = ((stage.clientWidth + 24) / columns - 24) / (width + 2);
      return Math.max(1, Math.floor(Math.min(wide, (room / Math.ceil(n / columns) - 84) / (height + 2), 44)));
    };
    let best = [0, 1];
    for (let columns = 1; columns <= most; columns++) {
      const cell = cellOf(columns, isNarrow ? Infinity : room);
      if (cell > best[0]) best = [cell, columns];
    }
    for (let columns = 1; columns <= most && best[0] < LEAST_CELL; columns++) {
      const cell = Math.min(LEAST_CELL, cellOf(most + 1 - columns, Infinity));
      if (cell > best[0]) best = [cell, most + 1 - columns];
    }
    const [cell, columns] = best, px = (n) => `${cell * n}px`;
    part.cell = cell;
    panels.style.gridTemplateColumns = `repeat(${columns}, ${Math.max(cell * (width + 2), 200)}px)`;
    for (const {canvas, box} of part.views.values()) {
      Object.assign(box.style, {width: px(width + 2), height: px(height + 2)});
      Object.assign(canvas.style, {left: px(1), top: px(1), width: px(width), height: px(height)});
    }
    overlay();
  }

  // Lines, dots and handles over the pixels: no pixel is decided here.
  function overlay() {
    const [width, height] = state.size, cell = part.cell || 1;
    const points = state.vertices.map(([x, y]) => [x - state.origin[0], y - state.origin[1]]);
    const isNear = (point) => Math.max(...point.map(Math.abs)) < 1e5;
    const outline = (rows) => rows.filter((row) => row.every((i) => isNear(points[i])))
      .map((row) => `M${row.map((i) => points[i].join(" ")).join("L")}Z`).join("");
    const all = outline(state.triangles), own = outline(state.triangles.length > 1 ? [taken()] : []);
    const kind = [cell, width, height, samples.length, ...state.origin].join("-");
    for (const {sheet, counts} of part.views.values()) {
      if (sheet.dataset.kind !== kind) {
        sheet.dataset.kind = kind;
        sheet.setAttribute("viewBox", `-1 -1 ${width + 2} ${height + 2}`);
        sheet.replaceChildren(...ruled(width, height, cell, kind), svg("g"));
      }
      const isCounted = cell >= 14 && counts && state.look === "overdraw";
      const numbers = [...(isCounted ? counts : [])].flatMap((n, i) => n > 1
        ? [svg("text", {x: i % width + 0.5, y: Math.floor(i / width) + 0.5}, n)] : []);
      sheet.lastChild.replaceChildren(
        svg("g", {class: "counts"}, ...numbers), svg("path", {class: "halo", d: cell < 9 || !hasEdges ? "" : all}),
        svg("path", {class: "edges", d: hasEdges ? all : ""}), svg("path", {class: "taken", d: hasEdges ? own : ""}),
        svg("rect", {class: "ring", fill: "none"}),
        ...points.flatMap((point, i) => isNear(point) ? [grip(point, taken().indexOf(i), cell)] : []),
      );
      ring(sheet.querySelector(".ring"));
    }
  }
  // Lines between pixels and dots at samples, where there is room for them.
  function ruled(width, height, cell, kind) {
    const bars = (n, line) => Array.from({length: n + 1}, (_, i) => line(i)).join("");
    const lines = cell < 5 ? "" : bars(width, (x) => `M${x} 0V${height}`) + bars(height, (y) => `M0 ${y}H${width}`);
    const ruling = svg("g", {}, svg("path", {class: "lines", d: lines}), ...rims(width, height, cell));
    if (cell < 9 || !samples.length) return [ruling];
    const r = (samples.length > 4 ? 1 : 1.5) / cell, id = `dots-${kind}`;
    const dots = samples.map(([cx, cy]) => svg("circle", {class: "dots", cx, cy, r}));
    const pattern = svg("pattern", {id, width: 1, height: 1, patternUnits: "userSpaceOnUse"}, ...dots);
    return [svg("defs", {}, pattern), ruling, svg("rect", {width, height, fill: `url(#${id})`})];
  }
  // The numbers of columns and rows, in the margin, as many as have room.
  function rims(width, height, cell) {
    const longest = Math.max(...[0, 1].map((k) => `${state.origin[k] + state.size[k]}`.length));
    const every = [1, 2, 5, 10, 20, 50, 100].find((n) => n * cell >= 8 * longest + 6) ?? 100, size = Math.min(0.6, 9 / cell * 1.1);
    const text = (number, x, y) => svg("text", {class: "rim", x, y, "font-size": size}, number);
    const marks = (n, k) => Array.from({length: n}, (_, i) => i).filter((i) => (i + state.origin[k]) % every === 0);
    if (cell < 5 || longest > 5) return [];
    return [...marks(width, 0).map((i) => text(i + state.origin[0], i + 0.5, -0.5)),
      ...marks(height, 1).map((i) => text(i + state.origin[1], -0.5, i + 0.5))];
  }
  function grip([x, y], k, cell) {
    return svg("g", {class: corner !== null && k === corner ? "grip taken" : "grip"},
      svg("circle", {class: "reach", cx: x, cy: y, r: 22 / cell}),
      svg("circle", {class: "knob", cx: x, cy: y, r: (k < 0 ? 4 : 8) / cell}),
      ...(k < 0 ? [] : [svg("text", {x, y, "font-size": 11 / cell}, k + 1)]));
  }

  // -- why a pixel is whose --

  function tell({sentences, rows = [], n_more = 0}) {
    const edge = ({ends, kind, value, exact}) => make("tr", {title: `exactly ${exact}: twice the area to this edge`},
      make("th", {scope: "row"}, ends), make("td", {}, kind), make("td", {}, make(value === "0" ? "b.zero" : "span", {}, value)));
    const card = ({triangle, color, verdict, edges, weights, depth}) => make("section.card", {},
      make("h3", {}, make("i", {style: `background:${color}`}), `triangle ${triangle}`, make("small", {}, verdict)),
      make("table", {}, ...edges.map(edge)),
      make("p", {}, `weights ${weights}`, depth === null ? "" : `, depth ${depth}`));
    why.replaceChildren(...sentences.map((text) => make("p", {}, text)), make("div.cards", {}, ...rows.map(card)));
    if (n_more) why.append(make("p.hint", {}, `${n_more} more triangles are farther away.`));
  }

  // -- keys, and the column of choices: the data-name of an element says which value of the state it shows --

  stage.onkeydown = (event) => {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key, by = MOVES[key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (by && corner !== null) {
      const far = event.shiftKey ? 1 : step(), i = taken()[corner];
      move(i, state.vertices[i].slice(0, 2).map((value, k) => value + far * by[k]));
    } else if (by) {
      const far = event.shiftKey ? 8 : 1, next = (pixel ?? [0, 0]).map((at, k) => at + far * by[k]);
      const beyond = next.map((at, k) => Math.min(0, at) + Math.max(0, at - state.size[k] + 1));
      if (beyond.some(Boolean)) see(state.size, state.origin.map((at, k) => at + beyond[k]));
      inspect(next.map((at, k) => at - beyond[k]));
    } else if ("0123".includes(key)) {
      corner = key === "0" || !taken().length ? null : Number(key) - 1;
      overlay();
    } else if (key === "PageDown" || key === "PageUp") nextScene(key === "PageUp" ? -1 : 1).catch(told);
    else if ("+=-".includes(key)) zoom(key === "-" ? 1.25 : 0.8);
    else if (key === "Home") see(whole.size, whole.origin);
    else if (key === "e") find(".edged").click();
    else if (key === "f") change({look: state.look === "wireframe" ? "owners" : "wireframe"});
    else if (key === "Escape") boxes[0].focus();
    else if (key in EDIT_KEYS) edit(EDIT_KEYS[key]).catch(told);
    else return;
    event.preventDefault();
  };
  function controls() {
    for (const box of boxes) {
      const value = state[box.dataset.name];
      if (box.type === "checkbox") box.checked = value;
      else if (box !== box.getRootNode().activeElement || box.tagName === "SELECT") box.value = value?.[box.dataset.axis] ?? value ?? "";
    }
    for (const button of findAll("[data-look]")) button.setAttribute("aria-pressed", button.dataset.look === state.look);
    for (const box of findAll(".coordinates input")) {
      const row = state.vertices[taken()[box.dataset.corner]];
      if (box !== box.getRootNode().activeElement) box.value = row?.[box.dataset.axis] ?? "";
    }
    const n = state.triangles.length;
    find(".which").textContent = n ? `Triangle ${chosen} of ${n}` : "No triangle";
    for (const what of ["split", "flip", "remove"]) find(`[data-edit=${what}]`).disabled = !n;
    find("[data-edit=undo]").disabled = !past.length;
    find(".about").textContent = aboutScene.get(state.scene) ?? "";
    find(".deep").hidden = (state.vertices[0]?.length ?? 2) < 3;
  }
  for (const box of boxes) {
    const {name, axis} = box.dataset;
    box.onchange = () => {
      if (name === "scene") return void (box.value && takeScene(box.value).catch(told));
      const value = box.type === "checkbox" ? box.checked : Number(box.value) >= 0 && box.value ? Number(box.value) : box.value;
      change({[name]: axis ? state[name].with(axis, value) : value});
    };
  }
  const option = (text, value = text, title = "") => make("option", {value, title}, text);
  for (const box of [find("[data-name=method]"), find("[data-name=other]")]) {
    for (const kind of ["production", "of the literature"]) {
      const own = methods.filter((one) => one.is_classic === (kind !== "production"));
      box.append(make("optgroup", {label: kind}, ...own.map(({name, summary}) => option(name, name, summary))));
    }
  }
  boxes[0].append(option(scenes.includes(app.hello.name) ? "from a link" : app.hello.name, ""), ...sceneOptions(app));
  for (let k = 0; k < 6; k++) {
    const corner = k >> 1, axis = k & 1;
    const box = make("input", {type: "number", step: "any", "aria-label": `corner ${corner + 1}, ${"xy"[axis]}`});
    Object.assign(box.dataset, {corner, axis});
    box.onchange = () => {
      const i = taken()[corner];
      if (i !== undefined && box.value) move(i, state.vertices[i].with(axis, Number(box.value)));
    };
    find(".coordinates").append(...(axis ? [] : [make("span", {}, `${corner + 1}`)]), box);
  }
  const zooms = {in: () => zoom(0.8), out: () => zoom(1.25), all: () => see(whole.size, whole.origin)};
  for (const one of findAll("[data-zoom]")) one.onclick = zooms[one.dataset.zoom];
  find(".edged").onchange = ({target}) => (hasEdges = target.checked, overlay());
  for (const one of findAll("[data-look]")) one.onclick = () => change({look: one.dataset.look});
  for (const one of findAll("[data-edit]")) one.onclick = () => edit(one.dataset.edit).catch(told);
  for (const one of findAll("[data-save]")) {
    one.onclick = async () => {
      try {
        const {name, type, arrays} = await app.line.ask("pixels.export", {state, kind: one.dataset.save});
        download(name, arrays.content, type);
      } catch (error) {
        told(error);
      }
    };
  }
  find(".link").onclick = app.copyLink;
  plan.ontoggle = explain;
  new ResizeObserver(() => panel.hidden || !part.views.size || fit()).observe(stage);

  function enter() {
    if (!state.size) restore(app.hello.pixels);
  }
  return part;
}

// ---- Steps -----------------------------------------------------------------------------------------------------

function stepsPart(app, panel) {
  const part = {state: () => view, enter, restore}, view = {scene: "", method: "edge", subpixel_bits: 8, step: null};
  let trace = null, timer = null;
  const canvas = make("canvas"), over = svg("svg", {"aria-hidden": "true"}), now = svg("rect", {class: "now", height: 1});
  const told = make("p", {role: "status"}), values = make("dl.values"), about = make("p.hint"), legend = make("div.legend");
  const slider = make("input", {type: "range", min: 0, "aria-label": "Step", oninput: () => go(slider.valueAsNumber)});
  const speed = make("input", {type: "range", min: 0, max: 3, step: 0.25, value: 1});
  const actions = {
    First: ["⇤", "Home", () => go(0)], "Triangle back": ["⟪", "PageUp", () => leap(-1, 4)],
    "Row back": ["«", "Shift+ArrowLeft", () => leap(-1)], Back: ["‹", "ArrowLeft", () => go(view.step - 1)],
    Play: ["▶", " ", toggle],
    Step: ["›", "ArrowRight", () => go(view.step + 1)], Row: ["»", "Shift+ArrowRight", () => leap(1)],
    Triangle: ["⟫", "PageDown", () => leap(1, 4)], Last: ["⇥", "End", () => go(Infinity)],
  };
  const buttons = Object.entries(actions).map(([name, [sign, key, onclick]]) =>
    make("button", {type: "button", title: `${name}: ${key === " " ? "Space" : key}`, "aria-label": name, onclick}, sign));

  function toggle() {
    const isOn = timer === null && trace !== null;
    clearTimeout(timer);
    timer = null;
    buttons[4].textContent = isOn ? "❚❚" : "▶";
    if (isOn && view.step >= trace.steps.length) go(0);
    if (isOn) tick();
  }
  function tick() {
    if (view.step >= trace.steps.length || panel.hidden) return toggle();
    go(view.step + 1);
    timer = setTimeout(tick, 1000 / 10 ** speed.value);
  }
  // To the first step of another row or triangle; from the fourth number on of another triangle.
  function leap(way, first = 1) {
    const place = (k) => trace.steps[k - 1]?.slice(first, 5).filter((_, i) => i % 3 === 0).join();
    let k = view.step + way;
    while (k > 0 && k < trace.steps.length && place(k) === place(view.step)) k += way;
    go(k);
  }
  function go(step) {
    view.step = Math.max(0, Math.min(trace.steps.length, step));
    const [width, height] = trace.size, counts = new Uint32Array(width * height), pixels = new Uint8ClampedArray(4 * width * height);
    for (const [x, y, last, isDrawn, triangle, kind] of trace.steps.slice(0, view.step)) {
      if (kind === "triangle" || kind === "row") continue;
      for (let i = y * width + x; i <= y * width + last; i++) {
        if (isDrawn) pixels.set(counts[i]++ ? [...TWICE, 255] : [...OWNERS[triangle % OWNERS.length], 255], 4 * i);
        else if (!counts[i]) pixels.set([128, 128, 128, 80], 4 * i);
      }
    }
    paint(canvas, Object.assign(pixels, {shape: [height, width, 4]}));
    const [x, y, last, , , , sentence, numbers] = trace.steps[view.step - 1] ?? [0, 0, -1, 0, 0, 0, "Nothing is drawn yet.", []];
    for (const [name, value] of Object.entries({x, y, width: last - x + 1})) now.setAttribute(name, value);
    told.textContent = `${view.step} of ${trace.steps.length}. ${sentence}`;
    values.replaceChildren(...numbers.flatMap(([name, text, change]) =>
      [make("dt", {}, name), make(text.startsWith("-") ? "dd.bad" : "dd", {}, text), make("dd.change", {}, change)]));
    Object.assign(slider, {max: trace.steps.length}, {value: view.step});
    app.keep();
  }
  const record = newest(async () => {
    try {
      const drawn = app.parts.pixels.scene().size ? app.parts.pixels.scene() : app.hello.pixels;
      const scene = view.scene ? (await app.line.ask("pixels.scene", {name: view.scene})).state : drawn;
      const {vertices, triangles, size, origin} = scene, {method, subpixel_bits} = view, [width, height] = size;
      const asked = JSON.stringify([view.scene, method, subpixel_bits]);
      if (!trace) told.textContent = "The steps are being recorded.";
      trace = await app.line.ask("steps.trace", {vertices, triangles, size, origin, method, subpixel_bits});
      if (asked !== JSON.stringify([view.scene, view.method, view.subpixel_bits])) return;  // a link has come in between
      methods.replaceChildren(...trace.methods.map((name) => make("option", {value: name}, name)));
      methods.value = method;
      about.textContent = trace.about;
      over.setAttribute("viewBox", `0 0 ${width} ${height}`);
      over.replaceChildren(...["halo", "edges"].flatMap((name) => trace.outlines.map((points) => svg("polygon", {class: name, points}))), now);
      for (const [name, value] of Object.entries({width, height})) over.parentNode.style.setProperty(`--${name}`, value);
      app.say("");
      const colors = trace.outlines.slice(0, OWNERS.length).map((_, i) => [`triangle ${i}`, OWNERS[i]]);
      legend.replaceChildren(...keyOf([...colors, ["tested, not drawn", [190, 190, 190]], ["drawn again", TWICE]]));
      go(view.step ?? 0);
    } catch (error) {
      app.say(error.message, true);
    }
  });
  const set = (name, read = String) => (value) => (Object.assign(view, {[name]: read(value), step: null}), record());
  const scenes = choose("scene", [["", "that of Pixels"]], "", set("scene"));
  scenes.lastChild.append(...sceneOptions(app));
  const chosen = choose("method", [["edge"]], "edge", set("method")), methods = chosen.lastChild;
  const bits = choose("sub-pixel bits", [[0], [1], [2], [4], [8], [12], [16]], 8, set("subpixel_bits", Number));
  const press = (event) => {
    const act = Object.values(actions).find(([, key]) => key === (event.shiftKey ? "Shift+" : "") + event.key)?.[2];
    if (!act || !trace || /SELECT|INPUT/.test(event.target.tagName) || (event.key === " " && event.target.tagName === "BUTTON")) return;
    event.preventDefault();
    act();
  };
  const layout = make("div.layout", {tabIndex: -1, onkeydown: press}, make("div.stage", {}, make("div.magnified", {}, canvas, over), legend), make("div.side", {},
    group("Steps", make("div.segments", {role: "group"}, ...buttons), slider, row("speed", speed)), group("Now", told, values), group("Drawn", scenes, chosen, bits, about)));
  function enter() {
    panel.append(layout);
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
  const view = {...home(), fov: 40, up: "y", layer: "smooth", lights: "headlight", edges: false, sampling: "at rest", tolerance: 0, cull: "none", spin: false};
  const frames = {painted: 0, asked: 0, newest: 0, times: [], last: null, waiting: null, rest: 0};
  const part = {state: () => view, enter, restore, view, frames, change};
  const canvas = make("canvas", {tabIndex: 0, role: "img", "aria-label": "The mesh: arrows turn it, with Shift they move it, plus and minus zoom"});
  const over = svg("svg", {"aria-hidden": "true"}), stage = make("div.stage.mesh", {}, canvas, over), side = make("div.side");
  const facts = make("p"), rate = make("p.hint"), found = make("dl.values"), legend = make("div.legend"), planText = make("pre", {tabIndex: 0});
  const planBox = make("details", {ontoggle: () => plan()}, make("summary", {}, "The plan, and why"), planText);
  const file = make("input", {type: "file", onchange: () => open(file.files[0])});
  let mesh = null;

  const size = () => [stage.clientWidth, stage.clientHeight].map((n) => Math.max(1, Math.round(n * Math.min(devicePixelRatio, 2))));
  const ask = (name, more) => app.line.ask(`mesh.${name}`, {...view, size: size(), ...more}).catch((error) => void app.say(error.message, true));
  const paper = () => getComputedStyle(app.root).backgroundColor.match(/\d+/g).slice(0, 3).map(Number);
  // A view that changes comes as a JPEG, with the colour of the page behind it, and once more as it is when it rests. The
  // next frame is asked for before this one is on the screen: Python draws while the browser decodes and paints.
  const draw = newest(async (isAtRest = false) => {
    clearTimeout(frames.rest);
    const start = performance.now(), number = ++frames.asked, frame = await ask("draw", isAtRest ? {} : {background: paper()});
    if (frame) decode(Object.assign(frame, {took: performance.now() - start, number, isAtRest}));
    if (view.spin && !panel.hidden) view.azimuth = (view.azimuth + 1.5) % 360, draw();
    else if (frame && !isAtRest) frames.rest = setTimeout(() => draw(true), 300);
  });
  async function decode(frame) {
    const [, , width, height] = frame.box, {pixels} = frame.arrays, start = performance.now();
    if (pixels.length) frame.image = !frame.is_jpeg ? new ImageData(pixels, width, height) : await createImageBitmap(new Blob([pixels]));
    frame.decode = performance.now() - start;
    if (frame.number < frames.newest) return;
    frames.newest = frame.number;
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
    rate.textContent = `${frame.isAtRest ? "" : `${frames.times.length} frames in a second, `}drawn in ${frame.draw_ms.toFixed(1)} ms, `
      + `here after ${frame.took.toFixed(1)} ms${frame.level === undefined ? "" : `; level ${frame.level}, ${frame.level_triangles.toLocaleString("en")} triangles`}`;
  }
  function change(values) {
    Object.assign(view, values);
    view.elevation = Math.max(-90, Math.min(90, view.elevation));
    view.zoom = Math.max(0.05, Math.min(1000, view.zoom));
    over.replaceChildren();
    legend.replaceChildren(...keyOf(view.layer === "overdraw" ? mesh?.heat : []));
    if (mesh) draw(), plan();
    app.keep();
  }
  const plan = newest(async () => {
    if (planBox.open) planText.textContent = (await ask("plan"))?.text ?? "";
  });

  async function pick({clientX, clientY}) {
    const {left, top, width} = canvas.getBoundingClientRect(), scale = canvas.width / width, size = [canvas.width, canvas.height];
    const [x, y] = [clientX - left, clientY - top].map((at) => Math.floor(at * scale)), hit = await ask("pick", {size, x, y});
    found.replaceChildren(...[["pixel", `${x}, ${y}`], ...hit?.rows ?? []].flatMap(([name, text]) => [make("dt", {}, name), make("dd", {}, text)]));
    over.setAttribute("viewBox", `0 0 ${size.join(" ")}`);
    over.replaceChildren(...["halo", "taken"].map((name) => svg("polygon", {class: name, points: (hit?.corners_px ?? []).join(" ")})));
  }
  async function open(given) {
    found.replaceChildren(), over.replaceChildren();
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
    const saved = await ask("save", {what});
    if (saved) download(saved.name, saved.arrays.file);
  }

  // One finger or button turns; the other button, Shift or two fingers move; two fingers and the wheel zoom.
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
  canvas.oncontextmenu = panel.ondragover = (event) => event.preventDefault();
  panel.ondrop = (event) => (event.preventDefault(), event.dataTransfer.files[0] && open(event.dataTransfer.files[0]));
  canvas.addEventListener("wheel", (event) => (event.preventDefault(), change({zoom: view.zoom * 1.0015 ** -event.deltaY})), {passive: false});
  canvas.onkeydown = (event) => {
    const [x, y] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key] ?? [0, 0];
    const zoom = {"+": 1.1, "=": 1.1, "-": 1 / 1.1}[event.key];
    if ((x || y) && event.shiftKey) change({pan: [view.pan[0] + 0.05 * x, view.pan[1] + 0.05 * y]});
    else if (x || y) change({azimuth: view.azimuth + 5 * x, elevation: view.elevation + 5 * y});
    else if (zoom || event.key === "0") change(zoom ? {zoom: view.zoom * zoom} : home());
    else return;
    event.preventDefault();
  };

  // Python lists what can be chosen: groups of [label, name in the view, options]; a check where there are none.
  function controls() {
    const control = ([label, name, options]) => {
      if (options) return choose(label, options, view[name], (text) => change({[name]: typeof view[name] === "number" ? Number(text) : text}));
      const box = make("input", {type: "checkbox", checked: view[name], onchange: () => change({[name]: box.checked})});
      return make("label.check", {}, box, label);
    };
    const saves = Object.entries({PNG: "png", Python: "code", "Job file": "job"}).map(([text, what]) => button(text, () => save(what)));
    side.replaceChildren(
      group("Mesh", facts, make("label.file", {}, file, "Open a file, or drop one"), rate),
      ...mesh.controls.map(([title, rows]) => group(title, ...rows.map(control))), legend,
      make("div.buttons", {}, button("Reset the camera", () => change(home()), "0")),
      group("Picked", make("p.hint", {}, "A click tells which triangle shows."), found),
      group("Keep", make("div.buttons", {}, ...app.hello.saves ? [] : saves, button("Copy link", () => app.copyLink())), ...app.hello.has_plan === false ? [] : [planBox]));
  }
  panel.append(make("div.layout", {}, stage, side));
  new ResizeObserver(() => mesh && !panel.hidden && draw()).observe(stage);
  function enter() {
    if (mesh) draw();
    else open();
  }
  function restore(given) {
    for (const name of Object.keys(view)) if (name in given) view[name] = given[name];
    if (mesh) controls(), change({});
  }
  return part;
}

// ---- Race ------------------------------------------------------------------------------------------------------

function racePart(app, panel) {
  const view = {family: "fan", positions: [3], seed: 0}, part = {state: () => view, enter, restore, drawn: 0};
  const stage = make("div.stage.race"), sliders = make("div"), what = make("p"), chart = make("table.chart"), by = make("p.hint"), side = make("div.side");
  let known = null, racers = [], mapped = "";

  const draw = newest(async () => {
    const told = await app.line.ask("race.draw", view).catch((error) => void app.say(error.message, true));
    if (!told) return;
    const {pictures} = told.arrays, shape = pictures.shape.slice(1), n = pictures.length / racers.length;
    racers.forEach(({canvas, count, figure}, k) => {
      const {text, title, bad} = told.rows[k];
      paint(canvas, Object.assign(pictures.slice(k * n, (k + 1) * n), {shape}));
      Object.assign(count, {textContent: text, className: bad === 0 ? "good" : "bad"});
      figure.title = title;
    });
    sliders.querySelectorAll("output").forEach((output, i) => (output.textContent = told.values[i]));
    const here = Math.round(view.positions.at(-1)) + 1;
    for (const line of chart.rows) [...line.cells].forEach((cell, i) => cell.classList.toggle("here", i === here));
    part.drawn++;
    app.say("");
  });
  // The chart is filled column by column; another family, seed or first parameter begins another.
  async function map() {
    const {axes} = known.families[view.family], axis = axes.at(-1), others = view.positions.slice(0, -1);
    const wanted = JSON.stringify([view.family, view.seed, others]);
    if (mapped === wanted) return;
    mapped = wanted;
    by.textContent = `Wrong pixels, in % of those that an edge meets, by ${axis.what}. A dot: with gaps.`;
    const head = axis.steps.map((step, i) => make("th", {scope: "col"}, button(step, () => set(axes.length - 1, i))));
    chart.replaceChildren(make("thead", {}, make("tr", {}, make("th"), ...head)), make("tbody", {}, ...known.methods.map((name) =>
      make("tr", {}, make("th", {scope: "row"}, name), ...head.map(() => make("td"))))));
    for (let i = 0; i < axis.steps.length; i++) {
      const column = await app.line.ask("race.column", {...view, positions: [...others, i]}).catch(() => null);
      if (mapped !== wanted || !column) return;
      column.cells.forEach(({text, color, kind, title}, k) => {
        const cell = Object.assign(chart.tBodies[0].rows[k].cells[i + 1], {textContent: text, title});
        cell.classList.add(...kind.split(" "));
        cell.style.background = color;
      });
    }
  }
  function redraw() {
    draw(), map(), app.keep();
  }
  function set(i, position) {
    view.positions[i] = position;
    sliders.querySelectorAll("input")[i].value = position;
    redraw();
  }
  function take(family) {
    const {axes, what: text} = known.families[family];
    if (family !== view.family || view.positions.length !== axes.length) view.positions = axes.map(() => 0);
    view.family = family;
    what.textContent = `${text[0].toUpperCase()}${text.slice(1)}. Each pixel has to be drawn once, and as the vertices say before any snap. auto snaps vertices to 2^-8 px first, so a pixel whose centre an edge passes that closely may be another triangle's; "auto, exact" snaps nothing and has no wrong pixel.`;
    sliders.replaceChildren(...axes.map(({what, steps, is_continuous}, i) => make("label.slider", {}, make("span", {}, `${what}: `, make("output")), make("input", {
      type: "range", min: 0, max: steps.length - 1, step: is_continuous ? 0.05 : 1, value: view.positions[i], oninput: ({target}) => set(i, target.valueAsNumber),
    }))));
    redraw();
  }
  function build() {
    const seed = make("input", {type: "number", min: 0, max: (known.n_seeds ?? 100) - 1, value: view.seed, onchange: () => (view.seed = Math.min(seed.max, Math.max(0, seed.valueAsNumber | 0)), redraw())});
    const families = Object.keys(known.families).map((name) => [name]);
    side.replaceChildren(group("Race", choose("family", families, view.family, take), what, sliders, row("seed", seed), make("div.legend", {}, ...keyOf(known.key))));
    take(view.family);
  }
  async function enter() {
    if (panel.firstChild) return;
    panel.append(make("div.layout.wide", {}, stage, side, group("Chart", by, make("div.scroll", {tabIndex: 0}, chart))));
    known = await app.line.ask("race.families");
    racers = known.methods.map((name) => {
      const canvas = make("canvas"), count = make("span");
      return {canvas, count, figure: make("figure", {}, canvas, make("figcaption", {}, name.replace(/[_/]/g, "$&\u200b"), count))};
    });
    stage.append(...racers.map(({figure}) => figure));
    build();
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
    if (!(app.hello.tabs ?? Object.keys(PARTS)).includes(tab) || !text) return false;
    app.show(tab);
    try {
      app.parts[tab].restore?.(JSON.parse(decodeURIComponent(text)));
    } catch (error) {
      app.say(`This link cannot be read: ${error.message}`, true);
    }
    return true;
  };

  try {
    app.line = await connect(() => app.say("The explorer has ended. Start it again to go on.", true), root);
    app.hello = await app.line.ask("hello");
  } catch (error) {
    return void app.say(error.message, true);
  }
  const {tabs: shown = Object.keys(PARTS), saves, has_plan: hasPlan = true} = app.hello;
  for (const tab of tabs) tab.hidden = !shown.includes(tab.dataset.tab);
  for (const plan of root.querySelectorAll(".plan")) plan.hidden = !hasPlan;
  for (const one of root.querySelectorAll("[data-save]")) one.hidden = saves && !saves.includes(one.dataset.save);
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
  if (app.line.note) app.say(app.line.note);
  return app;
}

// In a notebook: anywidget calls this for each cell.
async function render({model, el}) {
  el.innerHTML = model.get("markup");
  await start(el.querySelector(".explorer"), () => notebookLine(model), false);
}
export default {render};

const page = document.querySelector("body > .explorer");
if (page) {
  page.classList.toggle("figure", new URLSearchParams(location.search).has("figure"));
  start(page, page.dataset.worker ? workerLine : socketLine);
}
