// The page of the explorer. It draws no triangle by itself: what methods draw comes from the engine (engine.js), Python or, in
// a page that was written with --export, a worker with the same kernels; lines and handles are laid over the pixels.

import {notebookLine, socketLine, workerLine} from "./line.js";
import {meshPart} from "./mesh_part.js";
import {pixelsPart} from "./pixels_part.js";
import {racePart} from "./race_part.js";
import {stepsPart} from "./steps_part.js";

// The parts of the page. `enter` is called when its tab is shown, `state` is what goes into the link of the page, and
// `restore` takes it back.
const PARTS = {pixels: pixelsPart, steps: stepsPart, mesh: meshPart, race: racePart};

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
