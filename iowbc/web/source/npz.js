/** Reads NumPy's .npz files of numbers: a zip of .npy files, stored or deflated. */

const CENTRAL = 0x02014b50, END = 0x06054b50;
const TYPES = { "<f4": Float32Array, "<f8": Float64Array, "<i4": Int32Array, "<i8": BigInt64Array, "|b1": Uint8Array };

/** Arrays by name, each as {shape, data}. Throws for a file that is no .npz of numbers. */
export async function readNpz(buffer) {
  const view = new DataView(buffer);
  let end = buffer.byteLength - 22;
  while (end >= 0 && view.getUint32(end, true) !== END) end -= 1;
  if (end < 0) throw new Error("not an .npz file: it has no directory");
  const arrays = {};
  let place = view.getUint32(end + 16, true);
  for (let left = view.getUint16(end + 10, true); left > 0; left -= 1) {
    if (view.getUint32(place, true) !== CENTRAL) throw new Error("not an .npz file: its directory is damaged");
    const method = view.getUint16(place + 10, true), size = view.getUint32(place + 20, true);
    const name = view.getUint16(place + 28, true), more = view.getUint16(place + 30, true);
    const comment = view.getUint16(place + 32, true), header = view.getUint32(place + 42, true);
    const title = new TextDecoder().decode(new Uint8Array(buffer, place + 46, name));
    const start = header + 30 + view.getUint16(header + 26, true) + view.getUint16(header + 28, true);
    const packed = buffer.slice(start, start + size);
    arrays[title.replace(/\.npy$/, "")] = readNpy(method === 0 ? packed : await inflate(packed));
    place += 46 + name + more + comment;
  }
  return arrays;
}

function inflate(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(stream).arrayBuffer();
}

function readNpy(buffer) {
  const view = new DataView(buffer);
  const wide = view.getUint8(6) > 1;
  const start = wide ? 12 : 10;
  const stop = start + (wide ? view.getUint32(8, true) : view.getUint16(8, true));
  const header = new TextDecoder().decode(new Uint8Array(buffer, start, stop - start));
  const type = TYPES[/'descr': '([^']+)'/.exec(header)?.[1]];
  if (!type || /'fortran_order': True/.test(header)) throw new Error(`cannot read an array with the header ${header}`);
  const shape = (/'shape': \(([^)]*)\)/.exec(header)?.[1].match(/\d+/g) ?? []).map(Number);
  return { shape, data: new type(buffer.slice(stop)) };
}
