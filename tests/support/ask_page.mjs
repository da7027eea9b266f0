// Calls functions of the page outside a browser: node ask_page.mjs PAGE [SITE]. Each line of standard input is JSON: a call
// {module, name, given, is_hashed} of a function of the folder PAGE, whose first arguments are the page's line and what it
// begins with, or the answer {header, parts} to a question. Each line of standard output is a call's {result} or {error}, or a question
// {ask, parts}; with SITE, which `topleft explore --export` has written, its worker answers questions.
import {createHash} from "node:crypto";
import {readFile} from "node:fs/promises";
import {createInterface} from "node:readline";
import {pathToFileURL} from "node:url";

const [page, site] = process.argv.slice(2), at = (folder, name) => new URL(name, pathToFileURL(`${folder}/`));
const {notebookLine} = await import(at(page, "line.js"));
const plain = (_, value) => ArrayBuffer.isView(value) ? Array.from(value, Number) : value;
const hashed = (_, value) => ArrayBuffer.isView(value) ? `${value.constructor.name} ${createHash("sha256").update(value).digest("hex")}` : value;
const write = (message, replaced = plain) => process.stdout.write(`${JSON.stringify(message, replaced)}\n`);
let answerer = null, kernels = null, hear;

if (site) {
  const [{Kernels}, {Answerer}] = [await import(at(site, "kernels.js")), await import(at(site, "local.js"))];
  const load = async (name) => (({buffer, byteOffset, length}) => buffer.slice(byteOffset, byteOffset + length))(await readFile(at(site, name)));
  kernels = await Kernels.of(await readFile(at(site, "topleft.wasm")));
  answerer = new Answerer(kernels, JSON.parse(await readFile(at(site, "data.json"), "utf8")), load);
}
const model = {
  on: (_, heard) => (hear = (header, parts) => heard(header, parts.map((part) => new DataView(part.buffer, part.byteOffset, part.byteLength)))),
  send: (header, _, parts) => answerer
    ? void answerer.answer({...header, parts}).then((answer) => hear(...answer))
    : write({ask: header, parts: parts.map((part) => Buffer.from(part).toString("base64"))}),
};
const line = notebookLine(model);
let hello = null;

// What tests ask besides functions of the page: arrays of the engine, files, a picture while no memory is left.
const tools = {
  draw: async (line, hello, given, methods) => {
    const {parseState, drawingOf} = await import(at(page, "state.js")), {drawScene} = await import(at(page, "engine.js"));
    const state = parseState(given, hello);
    return drawScene(line, state, methods.map((method) => drawingOf(state, method, hello)));
  },
  save: async (line, hello, state, kind) => {
    const {askAbout, drawPixels} = await import(at(page, "pixels.js")), {panels: [{picture}]} = await drawPixels(line, hello, state);
    return (await askAbout(line, hello, state, "pixels.export", {kind}, [picture])).arrays.content;
  },
  difference: async (line, hello, ...pair) => {
    const [one, two] = pair.map((drawing) => ({...drawing, counts: Int32Array.from(drawing.counts)}));
    return (await import(at(page, "pixels.js"))).differenceOf(one, two);
  },
  edited: async (line, hello, ...edit) => (await import(at(page, "edits.js"))).edited(...edit),
  ask: (line, hello, ...question) => line.ask(...question),
  memory: () => kernels.exports.memory.buffer.byteLength,
  drawFull: async (line, hello, state) => {
    const before = kernels.exports.web_used();
    for (let n = 2 ** 28; n >= 64; n /= 2) while (kernels.exports.web_room(n));
    return tools.draw(line, hello, state, ["auto"]).finally(() => kernels.exports.web_release(before));
  },
};

async function call({module, name, given, is_hashed: isHashed}) {
  try {
    hello ??= await line.ask("hello");
    const called = module === "tools" ? tools[name] : (await import(at(page, module)))[name];
    write({result: await called(line, hello, ...given) ?? null}, isHashed ? hashed : plain);
  } catch (error) {
    write({error: error.message});
  }
}
for await (const text of createInterface({input: process.stdin})) {
  const message = JSON.parse(text);
  if ("module" in message) call(message);
  else hear(message.header, message.parts.map((part) => new Uint8Array(Buffer.from(part, "base64"))));
}
