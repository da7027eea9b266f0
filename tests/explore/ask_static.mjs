// Asks the page that `topleft explore --export` has written, without a browser: node ask_static.mjs FOLDER SET, with a
// list of questions as JSON on standard input; a file of a question is named by "file", and
// one with "is_full" is asked while no memory is left, and the first mesh that it takes is
// too large. Out: a list of answers, arrays as base64.
import {readFile} from "node:fs/promises";
import {pathToFileURL} from "node:url";

const [folder, set] = process.argv.slice(2), at = (name) => new URL(name, pathToFileURL(`${folder}/`));
const {Kernels} = await import(at("kernels.js")), {Answerer} = await import(at("local.js"));
const chunks = [];
for await (const chunk of process.stdin) chunks.push(chunk);
const kernels = await Kernels.of(await readFile(at(`topleft-${set}.wasm`)));
const load = async (name) => (({buffer, byteOffset, length}) => buffer.slice(byteOffset, byteOffset + length))(await readFile(at(name)));
const answerer = new Answerer(kernels, JSON.parse(await readFile(at("data.json"), "utf8")), load);
const replies = [], {exports} = kernels;

// What was there is overwritten before memory ends.
function tooLarge() {
  kernels.exports = exports;
  exports.web_release(kernels.start);
  new Uint8Array(exports.memory.buffer, exports.web_room(64), 2 ** 20).fill(255);
  return -2;
}
for (const {file, is_full: isFull, ...question} of JSON.parse(Buffer.concat(chunks))) {
  const before = exports.web_used();
  for (let n = 2 ** 28; isFull && n >= 64; n /= 2) while (exports.web_room(n));
  if (isFull) kernels.exports = {...exports, web_take_mesh: tooLarge};
  const [header, parts] = await answerer.answer({id: 1, ...question}, file ? [new Uint8Array(await readFile(file))] : []);
  kernels.exports = exports;
  if (isFull) exports.web_release(before);
  replies.push({...header, bytes: parts.map((part) => Buffer.from(part).toString("base64")), memory: exports.memory.buffer.byteLength});
}
process.stdout.write(JSON.stringify(replies));
