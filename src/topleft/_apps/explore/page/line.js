// Questions of the page and their answers: over a socket, by POST, to a worker or to a notebook.

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
export function socketLine(onLost) {
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
export async function workerLine(onLost, root) {
  const worker = new Worker(new URL(root.dataset.worker, document.baseURI), {type: "module"});
  const line = new Line((header, parts) => worker.postMessage({...header, parts}), onLost);
  worker.onmessage = ({data: [header, parts]}) => line.hear(withArrays(header, parts));
  worker.onerror = (event) => (event.preventDefault?.(), line.lose(event.message));
  return line;
}

export function notebookLine(model) {
  const line = new Line((header, parts) => model.send({...header, parts: []}, undefined, parts));
  model.on("msg:custom", (header, parts) => line.hear(withArrays(header, parts)));
  return line;
}

// Calls a function that takes time with the newest arguments alone, one call at a time: a drag asks for no more
// pictures than come back.
export function newest(work) {
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
