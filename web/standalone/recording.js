// Reads a recording that slipgrasp has written (MCAP): the documents, the samples and the phase
// changes, by the layouts that the program has put into `data.recording`. Sizes in the file are
// bounded before anything is unpacked.
const MAGIC = "\x89MCAP0\r\n";
const [MESSAGE, CHUNK, ATTACHMENT, METADATA] = [5, 6, 9, 12];
const HEAD = 9; // bytes of opcode and length
const MESSAGE_HEAD = 22; // bytes from channel to publish time
const MOST_BYTES = 1 << 26;
const MOST_UNPACKED = 1 << 28;
const READERS = {
  double: [8, (view, at) => view.getFloat64(at, true)],
  fixed32: [4, (view, at) => view.getUint32(at, true)],
  sint32: [1, (view, at) => (view.getUint8(at) >> 1) ^ -(view.getUint8(at) & 1)],
};

/** Documents by name, and chunks that are still packed, in a file's bytes. */
export function openRecording(bytes, { mostChunkBytes }) {
  if (bytes.length > MOST_BYTES) throw new Error(`it has more than ${MOST_BYTES} bytes`);
  if (String.fromCharCode(...bytes.subarray(0, MAGIC.length)) !== MAGIC) throw new Error("it is no MCAP file");
  const found = { documents: {}, chunks: [] };
  for (const { opcode, content } of recordsIn(bytes.subarray(MAGIC.length, -MAGIC.length))) {
    if (opcode === METADATA) found.documents[content.text()] = content.texts();
    else if (opcode === ATTACHMENT) takeAttachment(content, found.documents);
    else if (opcode === CHUNK) found.chunks.push(chunkOf(content, mostChunkBytes));
  }
  if (found.chunks.reduce((sum, { size }) => sum + size, 0) > MOST_UNPACKED) throw new Error("it is too long for a page");
  return found;
}

/** The numbers in the chunks of a recording, and its documents. */
export function readTables({ documents, chunks }, given) {
  const messages = new Map(given.topics.map(({ channel }) => [channel, []]));
  for (const chunk of chunks) takeMessages(window.slipgrasp.unpack(chunk), messages, given);
  return { documents, ...tablesOf(messages, given) };
}

class Cursor {
  constructor(bytes) {
    [this.bytes, this.at] = [bytes, 0];
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }
  take(count) {
    if (count > this.bytes.length - this.at) throw new Error("it ends within a record");
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }
  number(count) {
    const { byteOffset } = this.take(count);
    const at = byteOffset - this.bytes.byteOffset;
    if (count === 8) return Number(this.view.getBigUint64(at, true));
    return count === 4 ? this.view.getUint32(at, true) : this.view.getUint16(at, true);
  }
  text() {
    return new TextDecoder().decode(this.take(this.number(4)));
  }
  texts() {
    const [found, end] = [{}, this.number(4) + this.at];
    while (this.at < end) found[this.text()] = this.text();
    return found;
  }
}

function* recordsIn(bytes) {
  const records = new Cursor(bytes);
  while (records.at < bytes.length) {
    const [opcode] = records.take(1);
    yield { opcode, content: new Cursor(records.take(records.number(8))) };
  }
}

function takeAttachment(content, documents) {
  content.take(16); // times
  const name = content.text();
  content.text(); // its media type
  documents[name] = new TextDecoder().decode(content.take(content.number(8)));
}

function chunkOf(content, most) {
  content.take(16); // times
  const size = content.number(8);
  content.take(4); // its checksum: every number is compared
  const compression = content.text();
  if (compression !== "zstd" || size > most) throw new Error("it has a chunk that slipgrasp does not write");
  return { size, data: content.take(content.number(8)) };
}

function takeMessages(bytes, messages, { topics }) {
  for (const { opcode, content } of recordsIn(bytes)) {
    const channel = opcode === MESSAGE ? content.number(2) : -1;
    const topic = topics.find((each) => each.channel === channel);
    if (!topic) continue;
    if (content.bytes.length !== MESSAGE_HEAD + topic.bytes) throw new Error(`a message of ${topic.name} has another length`);
    messages.get(channel).push(new DataView(bytes.buffer, content.bytes.byteOffset + MESSAGE_HEAD, topic.bytes));
  }
}

/** The numbers of samples and of phase changes, row after row, and where topics disagree on a time. */
function tablesOf(messages, { topics, changes, names, changeNames }) {
  const samples = topics.filter(({ name }) => name !== changes);
  const counts = samples.map(({ channel }) => messages.get(channel).length);
  const rows = new Float64Array(Math.min(...counts) * names.length);
  const twice = { row: Infinity };
  for (const [k, topic] of samples.entries()) {
    fill(rows, names.length, messages.get(topic.channel), topic.fields, k > 0 ? twice : null);
  }
  const topic = topics.find(({ name }) => name === changes);
  const phases = new Float64Array(messages.get(topic.channel).length * changeNames.length);
  fill(phases, changeNames.length, messages.get(topic.channel), topic.fields, null);
  return { rows, changes: phases, twice };
}

/** The time stands first in every topic; in `twice` goes the first row in which it is another one. */
function fill(table, width, views, [time, ...fields], twice) {
  for (let row = 0; row * width < table.length; row++) {
    const written = READERS.double[1](views[row], time[0]);
    if (twice === null) table[row * width + time[2]] = written;
    else if (!Object.is(written, table[row * width + time[2]]) && row < twice.row) {
      Object.assign(twice, { row, column: time[2], value: written });
    }
    for (const [offset, kind, first, count] of fields) {
      const [bytes, read] = READERS[kind];
      for (let k = 0; k < count; k++) table[row * width + first + k] = read(views[row], offset + k * bytes);
    }
  }
}
