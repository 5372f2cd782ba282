// Unpacks the parts of the file: zstd in base 88, after their sizes without and with packing.
const DIGITS = "!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~";

/** What a text encodes: the size of the content, and its packed bytes. */
function decode(text) {
  const values = new Uint8Array(128);
  [...DIGITS].forEach((digit, value) => (values[digit.charCodeAt(0)] = value));
  const words = new Uint32Array(text.length / 5);
  for (let word = 0, at = 0; word < words.length; word++) {
    let number = 0;
    for (const end = at + 5; at < end; at++) number = number * DIGITS.length + values[text.charCodeAt(at)];
    words[word] = number;
  }
  const [size, length] = words;
  return { size, data: new Uint8Array(words.buffer, 8, length) };
}

/** The decoder of zstd from its text, compiled; it is itself packed with gzip. */
async function loadDecoder(text) {
  const stream = new Blob([decode(text).data]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

/** A function that decompresses data of a known size. */
async function makeUnpack(decoder) {
  const env = { emscripten_notify_memory_growth: () => {} };
  const { exports } = await WebAssembly.instantiate(decoder, { env });
  return ({ size, data }) => {
    const [packed, place] = [exports.malloc(data.length), exports.malloc(size)];
    new Uint8Array(exports.memory.buffer).set(data, packed);
    const written = exports.ZSTD_decompress(place, size, packed, data.length);
    const bytes = new Uint8Array(exports.memory.buffer).slice(place, place + size);
    for (const each of [packed, place]) exports.free(each);
    if (written !== size) throw new Error("a part of it cannot be unpacked");
    return bytes;
  };
}
