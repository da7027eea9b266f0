// The part Steps: how a method draws, played step by step.

import {make, svg, group, row, choose, sceneOptions, keyOf, paint} from "./elements.js";
import {newest} from "./line.js";
import {aboutOf, recorded} from "./steps.js";

// Colours of triangles, and of what is drawn again: Okabe and Ito's, which all eyes tell apart.
const OWNERS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167]], TWICE = [213, 94, 0];

export function stepsPart(app, panel) {
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
      const {method, subpixel_bits} = view, [width, height] = scene.size;
      const asked = JSON.stringify([view.scene, method, subpixel_bits]);
      if (!trace) told.textContent = "The steps are being recorded.";
      trace = await recorded(app.line, app.hello, scene, method, subpixel_bits);
      if (asked !== JSON.stringify([view.scene, view.method, view.subpixel_bits])) return;  // a link has come in between
      methods.value = method;
      about.textContent = aboutOf(app.hello.methods.find(({name}) => name === method));
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
  const traced = app.hello.methods.flatMap(({name}) => name === "auto" ? [] : [[name]]);
  const chosen = choose("method", traced, "edge", set("method")), methods = chosen.lastChild;
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
