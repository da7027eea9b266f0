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

// The same of SVG, with attributes alone.
function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

// A labelled choice of words, [value, text] pairs or texts.
function choose(label, options, value, onchange) {
  const select = make("select", {onchange: () => onchange(select.value)}, options.map((option) => {
    const [own, text] = Array.isArray(option) ? option : [option, option];
    return make("option", {value: own}, text);
  }));
  select.value = value;
  return Object.assign(make("label.row", {}, make("span", {}, label), select), {select});
}

// A picture (H, W, 4) uint8 of Python's as it is, a canvas pixel for each of its pixels.
function paint(canvas, pixels) {
  const [height, width] = pixels.shape;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  canvas.getContext("2d").putImageData(new ImageData(pixels, width, height), 0, 0);
}

// What the page begins with in a part of it: `enter` is called when its tab is shown, `state` goes into the link.
const PARTS = {pixels: pixelsPart, steps: stepsPart, mesh: meshPart, race: racePart};

// ---- Pixels ----------------------------------------------------------------------------------------------------

function pixelsPart(app, panel) {
  return {enter() {}};
}

// ---- Steps -----------------------------------------------------------------------------------------------------

const OKABE_ITO = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167]];
const VERMILION = [213, 94, 0];

const TEACHERS_SCENES = {
  "two triangles": {vertices: [[2, 2], [14, 3], [4, 13], [14.5, 12.5]], triangles: [[0, 1, 2], [1, 3, 2]], size: [17, 16]},
  "edges through centres": {vertices: [[1.5, 1.5], [9.5, 1.5], [1.5, 9.5], [9.5, 9.5]], triangles: [[0, 1, 2], [1, 3, 2]], size: [11, 11]},
  "a sliver": {vertices: [[1, 2], [22, 8.4], [12, 4.6]], triangles: [[0, 1, 2]], size: [24, 11]},
};

function stepsPart(app, panel) {
  const view = {scene: "two triangles", method: "edge", subpixel_bits: 8, step: 0};
  let trace = null, scene = TEACHERS_SCENES[view.scene], timer = null, methods = null;
  const canvas = make("canvas.pixels"), lines = svg("svg", {class: "lines"});
  const slider = make("input", {type: "range", min: 0, max: 0, value: 0, "aria-label": "Step", oninput: () => go(+slider.value)});
  const told = make("p.told", {role: "status"}), values = make("dl.values"), about = make("p.muted");
  const play = make("button", {onclick: toggle, title: "Space"}, "Play");
  const speed = make("input", {type: "range", min: 0, max: 3, step: 0.25, value: 1});
  const buttons = [["First", () => go(0), "Home"], ["Row back", () => leap(-1), "Shift and left"], ["Back", () => go(view.step - 1), "Left"],
    ["Step", () => go(view.step + 1), "Right"], ["Row", () => leap(1), "Shift and right"], ["Last", () => go(Infinity), "End"]]
    .map(([text, onclick, title]) => make("button", {onclick, title}, text));
  buttons.splice(3, 0, play);

  function toggle() {
    const isOn = timer === null;
    clearTimeout(timer), timer = null;
    play.textContent = isOn ? "Pause" : "Play";
    if (isOn && view.step >= trace.steps.length) go(0);
    const tick = () => {
      if (view.step >= trace.steps.length || panel.hidden) return toggle();
      timer = setTimeout(() => (go(view.step + 1), timer !== null && tick()), 1000 / 10 ** speed.value);
    };
    if (isOn) timer = 0, tick();
  }
  // To the next or the last step in another row.
  function leap(way) {
    let k = view.step + way;
    const row = trace.steps[view.step - 1]?.[3];
    while (k > 0 && k < trace.steps.length && trace.steps[k - 1][3] === row) k += way;
    go(k);
  }
  function go(step) {
    view.step = Math.max(0, Math.min(trace.steps.length, step));
    const [width, height] = trace.size, pixels = new Uint8ClampedArray(4 * width * height), counts = new Int32Array(width * height);
    const color = (i, rgb, alpha) => pixels.set([...rgb, alpha], 4 * i);
    for (const [kind, triangle, x, y, last, isDrawn] of trace.steps.slice(0, view.step)) {
      if (y < 0 || y >= height || kind === "row" || kind === "triangle") continue;
      for (let at = Math.max(0, x); at <= Math.min(last, width - 1); at++) {
        const i = y * width + at;
        if (isDrawn) color(i, counts[i]++ ? VERMILION : OKABE_ITO[triangle % 4], 255);
        else if (!counts[i]) color(i, [128, 128, 128], 90);
      }
    }
    paint(canvas, Object.assign(pixels, {shape: [height, width, 4]}));
    const now = trace.steps[view.step - 1], outlines = scene.triangles.map((corners) =>
      svg("polygon", {points: corners.map((i) => scene.vertices[i].slice(0, 2).join(",")).join(" ")}));
    const origin = scene.origin ?? [0, 0];
    lines.setAttribute("viewBox", `${origin[0]} ${origin[1]} ${width} ${height}`);
    if (now) outlines.push(svg("rect", {class: "now", x: now[2] + origin[0], y: now[3] + origin[1], width: now[4] - now[2] + 1, height: 1}));
    lines.replaceChildren(...outlines);
    Object.assign(slider, {max: trace.steps.length, value: view.step});
    tell(now);
  }
  function tell(now) {
    values.replaceChildren();
    if (!now) return void (told.textContent = `${trace.steps.length} steps. Nothing is drawn yet.`);
    const [kind, triangle, x, y, last, isDrawn, numbers] = now;
    const isIn = isDrawn || numbers.is_inside;
    told.textContent = `${view.step} of ${trace.steps.length}: ` + {
      triangle: `triangle ${triangle} is set up.`, row: `row ${y} of triangle ${triangle}.`,
      line: `the ${numbers.side} line passes pixel ${x}, ${y}.`, span: `pixels ${x} to ${last} of row ${y} are drawn.`,
      test: `pixel ${x}, ${y} of triangle ${triangle} is asked: ${isIn ? (isDrawn ? "drawn" : "inside") : "outside"}.`,
    }[kind];
    const before = trace.steps.slice(0, view.step - 1).findLast((one) => one[0] === kind && one[1] === triangle)?.[6] ?? {};
    for (const [name, value] of Object.entries(numbers)) {
      const change = typeof value === "number" && typeof before[name] === "number" ? value - before[name] : null;
      values.append(make("dt", {}, name), make(value < 0 ? "dd.negative" : "dd", {}, `${JSON.stringify(value).replaceAll('"', "")}`),
        make("dd.change", {}, change === null ? "" : `${change < 0 ? "−" : "+"}${+Math.abs(change).toPrecision(6)}`));
    }
  }
  const record = newest(async () => {
    try {
      const {vertices, triangles, size, origin} = scene;
      trace = await app.line.ask("steps.trace", {vertices, triangles, size, origin, method: view.method, subpixel_bits: view.subpixel_bits});
      if (!methods) methods = choices.method.select.replaceChildren(...trace.methods.map((name) => make("option", {value: name}, name))) ?? trace.methods;
      choices.method.select.value = view.method;
      about.textContent = `${trace.summary}. ${trace.source}.`;
      app.say("");
      go(view.step);
    } catch (error) {
      app.say(error.message, true);
    }
  });
  function take(name) {
    view.scene = name, view.step = 0;
    scene = TEACHERS_SCENES[name] ?? app.parts.pixels?.scene?.() ?? scene;
    record();
  }
  const choices = {
    scene: choose("Scene", [...Object.keys(TEACHERS_SCENES), ["pixels", "that of Pixels"]], view.scene, take),
    method: choose("Method", [view.method], view.method, (name) => (view.method = name, view.step = 0, record())),
    bits: choose("Sub-pixel bits", ["0", "1", "2", "4", "8", "12", "16"], "8", (bits) => (view.subpixel_bits = +bits, view.step = 0, record())),
  };
  function build() {
    panel.append(make("div.layout", {}, make("div.stage", {}, make("div.magnified", {}, canvas, lines)), make("div.side", {},
      make("div.group", {}, make("h2", {}, "Steps"), make("div.buttons", {}, buttons), slider, make("label.row", {}, make("span", {}, "Speed"), speed), told, values),
      make("div.group", {}, make("h2", {}, "What is drawn"), Object.values(choices), about))));
    panel.addEventListener("keydown", (event) => {
      const isField = /SELECT|INPUT/.test(event.target.tagName);
      const act = {" ": toggle, ArrowRight: () => (event.shiftKey ? leap(1) : go(view.step + 1)), ArrowLeft: () => (event.shiftKey ? leap(-1) : go(view.step - 1)),
        Home: () => go(0), End: () => go(Infinity)}[event.key];
      if (!act || !trace || isField || (event.key === " " && event.target.tagName === "BUTTON")) return;
      event.preventDefault();
      act();
    });
    panel.tabIndex = -1;
    panel.onclick = (event) => event.target.closest("button, select, input") || panel.focus();
  }
  return {
    enter() {
      if (!panel.firstChild) build();
      if (view.scene === "pixels" || !trace) take(view.scene);
    },
    state: () => view,
    restore(kept) {
      Object.assign(view, kept);
      choices.scene.select.value = view.scene, choices.bits.select.value = view.subpixel_bits, trace = null;
      scene = TEACHERS_SCENES[view.scene] ?? scene;
    },
  };
}

// ---- Mesh ------------------------------------------------------------------------------------------------------

const FIRST_VIEW = {azimuth: 35, elevation: 20, zoom: 1, pan: [0, 0]};

function meshPart(app, panel) {
  const view = {...FIRST_VIEW, fov: 40, up: "y", layer: "smooth", lights: "headlight", edges: false, sampling: "center", tolerance: 0, cull: "none"};
  const canvas = make("canvas.view", {tabIndex: 0, role: "application", "aria-label": "The mesh. Arrows turn it, with Shift they move it, plus and minus zoom."});
  const mark = svg("svg", {class: "lines"}), stage = make("div.stage.mesh", {}, canvas, mark), side = make("div.side");
  const facts = make("p.facts"), rate = make("p.rate", {role: "status"}), found = make("dl.values"), legend = make("ul.legend");
  const planText = make("pre.plan"), planBox = make("details", {ontoggle: () => planBox.open && plan()}, make("summary", {}, "Plan of this view"), planText);
  const frames = {painted: 0, asked: 0, newest: 0, times: [], last: null, waiting: null, rest: 0};
  let mesh = null, spin = 0;

  const size = () => {
    const scale = Math.min(devicePixelRatio, 2), {clientWidth, clientHeight} = stage;
    return [Math.max(1, Math.round(clientWidth * scale)), Math.max(1, Math.round(clientHeight * scale))];
  };
  // A view that changes comes as a JPEG, with the colour of the page behind it, and once more as it is when it rests. The
  // next frame is asked for before this one is on the screen: Python draws while the browser decodes and paints.
  const draw = newest(async (isAtRest = false) => {
    clearTimeout(frames.rest);
    const start = performance.now(), number = ++frames.asked, background = isAtRest ? undefined : paper();
    try {
      const frame = await app.line.ask("mesh.draw", {...view, size: size(), background});
      frame.took = performance.now() - start;
      decode(frame, number, isAtRest);
    } catch (error) {
      app.say(error.message, true);
    }
    if (spin) view.azimuth = (view.azimuth + spin) % 360, draw();
    else if (!isAtRest) frames.rest = setTimeout(() => draw(true), 200);
  });
  const paper = () => getComputedStyle(app.root).backgroundColor.match(/\d+/g)?.slice(0, 3).map(Number) ?? [255, 255, 255];
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
    const frame = frames.waiting, [x, y] = frame.box, start = performance.now();
    frames.waiting = null;
    if (canvas.width !== frame.size[0] || canvas.height !== frame.size[1]) [canvas.width, canvas.height] = frame.size;
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (frame.image instanceof ImageData) context.putImageData(frame.image, x, y);
    else if (frame.image) context.drawImage(frame.image, x, y);
    frames.painted++, frames.last = frame, frame.paint = performance.now() - start;
    frames.times = [...frames.times.filter((time) => start - time < 1000), start];
    const level = frame.level === undefined ? "" : `, level ${frame.level} of ${frame.level_triangles.toLocaleString()} triangles`;
    const perSecond = frames.times.length > 2 ? `${frames.times.length} frames a second; ` : "";
    rate.textContent = `${perSecond}drawn in ${frame.draw_ms.toFixed(1)} ms, here after ${frame.took.toFixed(1)} ms${level}`;
  }
  function change(values) {
    Object.assign(view, values);
    view.elevation = Math.max(-90, Math.min(90, view.elevation));
    view.zoom = Math.max(0.05, Math.min(1000, view.zoom));
    mark.replaceChildren();
    draw();
    if (planBox.open) plan();
  }
  const plan = newest(async () => (planText.textContent = (await app.line.ask("mesh.plan", {...view, size: size()}).catch((error) => ({text: error.message}))).text));

  async function pick(event) {
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top].map((at) => Math.floor(at * scale));
    const hit = await app.line.ask("mesh.pick", {...view, size: [canvas.width, canvas.height], x, y}).catch((error) => void app.say(error.message, true));
    if (!hit) return;
    found.replaceChildren();
    mark.replaceChildren();
    if (hit.triangle < 0) return void found.append(make("dt", {}, "pixel"), make("dd", {}, `${x}, ${y}: nothing`));
    mark.setAttribute("viewBox", `0 0 ${canvas.width} ${canvas.height}`);
    mark.append(svg("polygon", {points: hit.corners_px.map((at) => at.join(",")).join(" ")}));
    const short = (numbers) => numbers.map((number) => +number.toPrecision(5)).join(", ");
    const rows = [["pixel", `${x}, ${y}`], [hit.is_level ? "triangle of the level" : "triangle", hit.triangle], ["vertices", hit.vertices.join(", ")],
      ...hit.positions.map((at, k) => [`corner ${k}`, short(at)]), ["barycentric", short(hit.barycentric)], ["depth", short([hit.depth])],
      ...(hit.uv ? [["uv", short(hit.uv)]] : []), ...(hit.material ? [["material", hit.material]] : [])];
    for (const [name, value] of rows) found.append(make("dt", {}, name), make("dd", {}, `${value}`));
  }
  async function open(file) {
    try {
      if (file) app.say(`Reading ${file.name}`);
      const parts = file ? [new Uint8Array(await file.arrayBuffer())] : [];
      mesh = await app.line.ask("mesh.open", {name: file?.name}, parts);
      facts.textContent = `${mesh.name}: ${mesh.n_triangles.toLocaleString()} triangles, ${mesh.n_vertices.toLocaleString()} vertices`;
      app.say(mesh.lacks.join("; "));
      controls();
      change(file ? {...FIRST_VIEW, pan: [0, 0]} : {});
    } catch (error) {
      app.say(error.message, true);
    }
  }
  async function save(what) {
    const {name, arrays} = await app.line.ask("mesh.save", {...view, size: size(), what}).catch((error) => (app.say(error.message, true), {}));
    if (!name) return;
    const link = make("a", {href: URL.createObjectURL(new Blob([arrays.file])), download: name});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
  const pointers = new Map();
  function move(event) {
    if (!pointers.has(event.pointerId)) return;
    const before = [...pointers.values()], old = pointers.get(event.pointerId), {clientHeight} = canvas;
    const [dx, dy] = [event.clientX - old.x, event.clientY - old.y];
    pointers.set(event.pointerId, {...old, x: event.clientX, y: event.clientY, moved: old.moved + Math.abs(dx) + Math.abs(dy)});
    const shift = (dx, dy) => [view.pan[0] + 2 * dx / clientHeight, view.pan[1] - 2 * dy / clientHeight];
    if (pointers.size === 2) {
      const reach = ([a, b]) => Math.hypot(a.x - b.x, a.y - b.y) || 1;
      change({pan: shift(dx / 2, dy / 2), zoom: view.zoom * reach([...pointers.values()]) / reach(before)});
    } else if (old.button || event.shiftKey) change({pan: shift(dx, dy)});
    else change({azimuth: view.azimuth - 0.4 * dx, elevation: view.elevation + 0.4 * dy});
  }
  function release(event) {
    const old = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (event.type === "pointerup" && old && old.moved < 4 && !old.button) pick(event);
  }
  function press(event) {
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    if (way && event.shiftKey) change({pan: [view.pan[0] + 0.05 * way[0], view.pan[1] + 0.05 * way[1]]});
    else if (way) change({azimuth: view.azimuth + 5 * way[0], elevation: view.elevation + 5 * way[1]});
    else if ("+=-0".includes(event.key)) change({"+": {zoom: view.zoom * 1.1}, "=": {zoom: view.zoom * 1.1}, "-": {zoom: view.zoom / 1.1}, 0: {...FIRST_VIEW, pan: [0, 0]}}[event.key]);
    else return;
    event.preventDefault();
  }
  function controls() {
    const set = (name, read = (text) => text) => (text) => (change({[name]: read(text)}), showLegend());
    const edges = make("input", {type: "checkbox", checked: view.edges, onchange: () => change({edges: edges.checked})});
    const turn = make("input", {type: "checkbox", checked: !!spin, onchange: () => (spin = turn.checked ? 1.5 : 0, draw())});
    const file = make("input", {type: "file", onchange: () => file.files[0] && open(file.files[0])});
    const check = (label, box) => make("label.row", {}, make("span", {}, label), box);
    side.replaceChildren(
      make("div.group", {}, make("h2", {}, "Mesh"), facts, rate, check("Open a file, or drop one", file)),
      make("div.group", {}, make("h2", {}, "Look"), choose("Layer", mesh.layers, view.layer, set("layer")), legend, choose("Light", mesh.lights, view.lights, set("lights")),
        check("Wireframe", edges), choose("Sampling", ["center", "msaa2", "msaa4", "msaa8", "msaa16"], view.sampling, set("sampling")),
        choose("Tolerance, px", ["0", "0.25", "0.5", "1", "2", "4"], `${view.tolerance}`, set("tolerance", Number)),
        choose("Cull", ["none", "back", "front"], view.cull, set("cull"))),
      make("div.group", {}, make("h2", {}, "Camera"), choose("Field of view", [["40", "40°"], ["20", "20°"], ["70", "70°"], ["0", "no perspective"]], `${view.fov}`, set("fov", Number)),
        choose("Up", ["y", "z"], view.up, set("up")), check("Turn", turn),
        make("div.buttons", {}, make("button", {onclick: () => change({...FIRST_VIEW, pan: [0, 0]})}, "Reset"))),
      make("div.group", {}, make("h2", {}, "Picked"), make("p.muted", {}, "A click tells what shows there."), found),
      make("div.group", {}, make("h2", {}, "Save"), make("div.buttons", {}, [["PNG", "png"], ["Python", "code"], ["Job file", "job"]].map(([text, what]) =>
        make("button", {onclick: () => save(what)}, text))), planBox));
    showLegend();
  }
  function showLegend() {
    legend.replaceChildren(...(view.layer === "overdraw" ? mesh.heat : []).map(([rgb, text]) => make("li", {}, make("i", {style: `background:rgb(${rgb})`}), text)));
  }
  function build() {
    panel.append(make("div.layout", {}, stage, side));
    canvas.onpointerdown = (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, moved: 0, button: event.button});
    };
    Object.assign(canvas, {onpointermove: move, onpointerup: release, onpointercancel: release, onkeydown: press, oncontextmenu: (event) => event.preventDefault()});
    canvas.addEventListener("wheel", (event) => (event.preventDefault(), change({zoom: view.zoom * 1.0015 ** -event.deltaY})), {passive: false});
    panel.ondragover = (event) => event.preventDefault();
    panel.ondrop = (event) => (event.preventDefault(), event.dataTransfer.files[0] && open(event.dataTransfer.files[0]));
    new ResizeObserver(() => mesh && !panel.hidden && draw()).observe(stage);
    side.append(make("div.group", {}, make("h2", {}, "Mesh"), facts, make("p.muted", {}, "Drop a file here: OBJ, PLY, STL, OFF, glTF, GLB."),
      make("input", {type: "file", "aria-label": "Mesh file", onchange: (event) => open(event.target.files[0])})));
    open();
  }
  return {enter: () => (panel.firstChild ? mesh && draw() : build()), state: () => view, restore: (kept) => Object.assign(view, kept), view, frames, change};
}

// ---- Race ------------------------------------------------------------------------------------------------------

const SHARES = ["#ffffcc", "#c7e9b4", "#7fcdbb", "#41b6c4", "#2c7fb8", "#253494"];

function racePart(app, panel) {
  const view = {family: "edge", positions: [0], seed: 0};
  const FAULTS = [null, OKABE_ITO[3], VERMILION, OKABE_ITO[0]];
  const stage = make("div.stage.race"), sliders = make("div"), what = make("p.muted"), chart = make("table.chart"), cards = [];
  let known = null, columns = [];

  const draw = newest(async () => {
    try {
      const told = await app.line.ask("race.draw", view), [width, height] = told.size, n = width * height;
      [...sliders.querySelectorAll("output")].forEach((output, i) => (output.textContent = told.values[i]));
      const {triangle, faults} = told.arrays;
      told.methods.forEach(({name, bad, gaps, overdrawn, refused}, k) => {
        const pixels = new Uint8ClampedArray(4 * n);
        for (let i = 0; i < n; i++) {
          const fault = FAULTS[faults[k * n + i]];
          pixels.set(fault ? [...fault, 255] : [128, 128, 128, refused || triangle[i] < 0 ? 0 : 40 + 25 * (triangle[i] % 3)], 4 * i);
        }
        paint(cards[k].canvas, Object.assign(pixels, {shape: [height, width, 4]}));
        cards[k].count.textContent = refused ? "refuses" : bad ? `${bad} wrong` : "right";
        cards[k].title = refused ?? `${bad} of ${n} pixels: ${gaps} gaps, ${overdrawn} drawn twice`;
        cards[k].classList.toggle("is-right", bad === 0);
      });
      app.say("");
      here();
    } catch (error) {
      app.say(error.message, true);
    }
  });
  // Columns of the chart come one by one; another family ends the walk.
  async function map() {
    const family = view.family, last = known.families[family].axes.length - 1, asked = JSON.stringify([family, view.seed, view.positions.slice(0, last)]);
    if (asked === map.asked) return;
    map.asked = asked, columns = [];
    grid();
    for (let i = 0; i < known.families[family].axes[last].steps.length && map.asked === asked; i++) {
      const column = await app.line.ask("race.column", {...view, positions: [...view.positions.slice(0, last), i]}).catch(() => null);
      if (map.asked !== asked || !column) return;
      columns[i] = column;
      column.rows.forEach(([bad, hasGaps], k) => {
        const cell = chart.tBodies[0].rows[k].cells[i + 1], share = bad / Math.max(1, column.n_edge_px);
        const level = Math.max(0, Math.min(5, Math.floor(Math.log10(share) * 1.5 + 6)));
        if (bad === null) return void Object.assign(cell, {className: "refused", title: "refuses to draw"});
        cell.textContent = bad ? (100 * share < 1 ? (100 * share).toFixed(1) : Math.round(100 * share)) : "";
        Object.assign(cell, {className: (level > 3 ? "dark" : "") + (hasGaps ? " gaps" : ""), title: `${bad} wrong pixels${hasGaps ? ", with gaps" : ""}`});
        cell.style.background = bad ? SHARES[level] : "";
      });
    }
  }
  function grid() {
    const {axes} = known.families[view.family], axis = axes.at(-1);
    chart.replaceChildren(make("caption", {}, `Wrong pixels, % of those that an edge meets, by ${axis.what}. A dot: with gaps.`),
      make("thead", {}, make("tr", {}, make("th"), axis.steps.map((step, i) => make("th", {scope: "col"}, make("button", {onclick: () => set(axes.length - 1, i)}, step))))),
      make("tbody", {}, known.methods.map((name) => make("tr", {}, make("th", {scope: "row"}, name), axis.steps.map(() => make("td"))))));
    here();
  }
  function here() {
    const at = Math.round(view.positions.at(-1));
    for (const line of chart.rows) [...line.cells].forEach((cell, i) => cell.classList.toggle("here", i === at + 1));
  }
  function set(i, position) {
    view.positions[i] = position;
    sliders.querySelectorAll("input")[i].value = position;
    draw();
    map();
  }
  function enterFamily(name) {
    const {axes, what: text} = known.families[name];
    if (name !== view.family || view.positions.length !== axes.length) view.positions = axes.map(() => 0);
    view.family = name, what.textContent = `${text[0].toUpperCase()}${text.slice(1)}. Each pixel has to be drawn once.`;
    sliders.replaceChildren(...axes.map((axis, i) => make("label.slider", {}, make("span", {}, axis.what, " ", make("output")),
      make("input", {type: "range", min: 0, max: axis.steps.length - 1, step: axis.is_continuous ? 0.05 : 1, value: view.positions[i], oninput: ({target}) => set(i, +target.value)}))));
    draw();
    map();
  }
  async function build() {
    panel.append(make("div.layout.wide"));
    known = await app.line.ask("race.families").catch((error) => void app.say(error.message, true));
    if (!known) return;
    const names = Object.keys(known.families), seed = make("input", {type: "number", min: 0, max: 99, value: view.seed, onchange: () => (view.seed = Math.max(0, +seed.value | 0), draw(), map())});
    cards.push(...known.methods.map((name) => {
      const canvas = make("canvas.pixels"), count = make("span.count");
      return Object.assign(make("figure.card", {}, canvas, make("figcaption", {}, make("b", {}, name), count)), {canvas, count});
    }));
    const key = [["another triangle shows", 1], ["a gap", 2], ["drawn more than once", 3]];
    stage.append(...cards);
    panel.firstChild.append(stage, make("div.side", {}, make("div.group", {}, make("h2", {}, "Race"), choose("Family", names, view.family, enterFamily), what, sliders,
      make("label.row", {}, make("span", {}, "Seed"), seed), make("ul.legend", {}, key.map(([text, i]) => make("li", {}, make("i", {style: `background:rgb(${FAULTS[i]})`}), text)))),
      make("div.group", {}, make("h2", {}, "Chart"), make("div.scroll", {}, chart))));
    enterFamily(view.family);
  }
  return {enter: () => panel.firstChild || build(), state: () => view, restore: (kept) => Object.assign(view, kept)};
}

// ---- the page --------------------------------------------------------------------------------------------------

// Fills an .explorer element with its parts. `app` is what they share: app.line.ask, app.say (a line of status),
// app.hello (what Python begins with), app.root, app.show(tab), app.parts.
export async function start(root, connect) {
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
      const step = {ArrowRight: 1, ArrowLeft: -1}[key];
      if (step) tabs.at((i + step) % tabs.length).focus(), app.show(tabs.at((i + step) % tabs.length).dataset.tab);
    };
  }
  app.show(app.hello.tab);
  root.app = app;
  return app;
}

// In a notebook: anywidget calls this for each cell.
async function render({model, el}) {
  el.innerHTML = model.get("markup");
  await start(el.querySelector(".explorer"), () => notebookLine(model));
}
export default {render};

const page = document.querySelector("body > .explorer");
if (page) start(page, socketLine);
