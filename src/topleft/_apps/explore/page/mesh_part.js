// The part Mesh: a mesh that is turned, picked and saved.

import {make, svg, group, button, choose, keyOf, download} from "./elements.js";
import {newest} from "./line.js";

export function meshPart(app, panel) {
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
      group("Keep", make("div.buttons", {}, ...saves, button("Copy link", () => app.copyLink())), planBox));
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
