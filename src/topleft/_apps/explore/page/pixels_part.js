// The part Pixels: triangles are moved, and their pixels watched.

import {edited} from "./edits.js";
import {make, svg, sceneOptions, download, paint} from "./elements.js";
import {newest} from "./line.js";
import {askAbout, drawPixels} from "./pixels.js";
import {probe} from "./probe.js";
import {EXACT, STATE_DEFAULTS} from "./state.js";

const MOVES = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
  a: [-1, 0], d: [1, 0], w: [0, -1], s: [0, 1],
};
const EDIT_KEYS = {n: "add", p: "split", r: "flip", Delete: "remove", z: "undo", "]": "forward", "[": "back"};

// A state is what is drawn: vertices, triangles, a window, methods and rules (state.js).
export function pixelsPart(app, panel) {
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
      const [pictures] = await Promise.all([drawPixels(app.line, app.hello, asked), app.line.ask("pixels.moved", {vertices: asked.vertices})]);
      show(pictures);
      if (!pixel && asked === state) inspect(pictures.panels.at(-1).pixel ?? state.size.map((n) => n >> 1));
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
    if (plan.open) plan.lastChild.textContent = (await askAbout(app.line, app.hello, state, "pixels.plan").catch(told))?.text ?? "";
  });
  const look = newest(async () => {
    const method = {b: state.other, exact: EXACT}[probed] || state.method;
    if (pixel) tell(await probe(app.line, app.hello, {state, pixel, sample, method}).catch(({message}) => ({sentences: [message]})));
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
    [pixel, probed] = [null, given.other ? "b" : "a"];
    whole = {size: given.size, origin: given.origin ?? [0, 0]};
    change({...STATE_DEFAULTS, ...given}, false);
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

  // Shows `factor` times as much round a place of the picture, which stays where it is; it is drawn anew.
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
      const {triangle, ...made} = edited(state, what, chosen);
      [corner, chosen] = [null, triangle];
      change(made);
    }
    overlay(), controls();
  }

  // -- the pictures --

  function show({panels: shown, samples: at}) {
    const isNew = samples.length !== at.length;
    samples = at;
    for (const [key, {figure}] of part.views) {
      if (!shown.some((one) => one.key === key)) figure.remove(), part.views.delete(key);
    }
    for (const {key, title, notes, facts, legend, refused, picture, owners, counts} of shown) {
      if (!part.views.has(key)) part.views.set(key, view(key));
      const one = part.views.get(key), text = facts.map(([words, kind, title = ""]) => make(`span.${kind}`, {title}, words));
      Object.assign(one, {owners, counts, picture});
      one.caption.replaceChildren(make("b", {}, title), make("span", {}, notes), make("div", {}, text));
      one.legend.replaceChildren(...legend.map(([color, words]) =>
        make("span", {}, make("i", {style: `background:${color}`}), words)), make("span.bad", {}, refused));
      one.box.hidden = !picture;
      if (picture) paint(one.canvas, picture);
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
        const {picture} = part.views.get("a"), kind = one.dataset.save;
        const {name, type, arrays} = await askAbout(app.line, app.hello, state, "pixels.export", {kind}, picture ? [picture] : []);
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
