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

function stepsPart(app, panel) {
  return {enter() {}};
}

// ---- Mesh ------------------------------------------------------------------------------------------------------

function meshPart(app, panel) {
  return {enter() {}};
}

// ---- Race ------------------------------------------------------------------------------------------------------

function racePart(app, panel) {
  return {enter() {}};
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
