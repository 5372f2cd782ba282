// Where close-ups go on the screen: beside what is held, apart from each other, near their contacts.

const GAP = 12; // px
const LEAST_RADIUS = 24;
const LARGEST_RADIUS = 110;
const SHARE = 0.13; // of the mean of width and height of the free area
const TO_STAY = 1.15; // how much larger close-ups must get for another arrangement
const TO_SWAP = 1.1; // how much less the squares of the lines to the contacts, for another order
const ABOVE_FIRST = 1.3; // how much larger they must be elsewhere

/**
 * Places close-ups in rows above or below a box, or in columns at its sides.
 *
 * contacts: points on the screen [px]; held: the box; free: the area that nothing covers;
 * words: how far captions reach above and below a close-up, and to either side of its middle;
 * before: what this function has returned last, or null, so that nothing jumps to and fro.
 *
 * Returns {name, radius, order, places: {x, y, end: where its line ends} of each contact}.
 */
export function place(contacts, held, free, words, before) {
  const found = arrangements(contacts.length, within(held, free), free, words);
  const large = found.filter(({ radius }) => radius >= LEAST_RADIUS);
  // So near that nothing is free: the close-ups cover what is held.
  const rows = () => rowsIn(contacts.length, "over", free, free, words, 2 * LEAST_RADIUS);
  const all = large.length > 0 ? large : rows();
  const best = all.reduce((a, b) => (score(b, before) > score(a, before) ? b : a));
  const order = bestOrder(contacts, best.places, before?.name === best.name ? before.order : null);
  return { ...best, order, places: order.map((slot) => best.places[slot]) };
}

function score({ name, radius }, before) {
  return radius * (name === before?.name ? TO_STAY : 1) * (name.startsWith("above") ? ABOVE_FIRST : 1);
}

/** A box with a margin, as much of it as is in the free area. */
function within(box, free) {
  const x = (value) => Math.min(Math.max(value, free.left), free.right);
  const y = (value) => Math.min(Math.max(value, free.top), free.bottom);
  return {
    left: x(box.left - GAP),
    right: x(box.right + GAP),
    top: y(box.top - GAP),
    bottom: y(box.bottom + GAP),
  };
}

function arrangements(count, box, free, words) {
  const most = Math.min(
    Math.max(0.5 * SHARE * (free.right - free.left + free.bottom - free.top), LEAST_RADIUS),
    LARGEST_RADIUS,
  );
  return [
    ...rowsIn(count, "above", box, free, words, most),
    ...rowsIn(count, "below", box, free, words, most),
    inColumns("beside", [Math.ceil(count / 2), Math.floor(count / 2)], box, free, words, most),
    inColumns("left", [count, 0], box, free, words, most),
    inColumns("right", [0, count], box, free, words, most),
  ];
}

/** All close-ups in one row, in two or in three. */
function rowsIn(count, side, box, free, words, most) {
  const numbers = [1, 2, 3].filter((rows) => rows <= count);
  return numbers.map((rows) => inRow(side, count, rows, box, free, words, most));
}

function inRow(side, count, rows, box, free, words, most) {
  const columns = Math.ceil(count / rows);
  const width = (free.right - free.left) / columns;
  const ends = { above: [free.top, box.top], below: [box.bottom, free.bottom], over: [free.top, free.bottom] };
  const [top, bottom] = ends[side];
  const captions = words.above + words.below;
  const radius = fit(most, width, (bottom - top) / rows - captions, words);
  const height = 2 * radius + captions;
  const half = Math.max(radius, words.half);
  const apart = Math.min(width, 2 * half + Math.max(radius, GAP));
  // Near what is held, and all of it in the free area.
  const first = side === "above" ? Math.max(top, bottom - GAP - rows * height) : Math.min(top + GAP, bottom - rows * height);
  const places = Array.from({ length: count }, (_, i) => {
    const row = Math.floor(i / columns);
    const inThis = Math.min(columns, count - row * columns);
    const reach = 0.5 * apart * (inThis - 1) + half;
    const middle = clamp(0.5 * (box.left + box.right), free.left + reach, free.right - reach);
    const x = middle + apart * ((i % columns) - 0.5 * (inThis - 1));
    const y = first + row * height + words.above + radius;
    return { x, y, end: [x, side === "below" ? y - radius - words.above : y + radius + words.below] };
  });
  return { name: `${side} ${rows}`, radius, places };
}

/** Columns at the left and at the right of a box, with some close-ups each. */
function inColumns(name, counts, box, free, words, most) {
  const widths = [box.left - free.left, free.right - box.right];
  const captions = words.above + words.below;
  const radius = Math.min(
    ...counts.map((count, k) =>
      count === 0 ? most : fit(most, widths[k] - GAP, (free.bottom - free.top) / count - captions, words),
    ),
  );
  const half = Math.max(radius, words.half);
  const places = counts.flatMap((count, k) => {
    const x = k === 0 ? Math.max(free.left + half, box.left - GAP - half) : Math.min(free.right - half, box.right + GAP + half);
    const height = 2 * radius + captions;
    const apart = Math.min((free.bottom - free.top) / Math.max(count, 1), height + GAP);
    const reach = 0.5 * apart * (count - 1);
    const middle = clamp(
      0.5 * (box.top + box.bottom),
      free.top + reach + words.above + radius,
      free.bottom - reach - words.below - radius,
    );
    return Array.from({ length: count }, (_, i) => {
      const y = middle + apart * (i - 0.5 * (count - 1));
      return { x, y, end: [k === 0 ? x + radius : x - radius, y] };
    });
  });
  return { name, radius, places };
}

/** The largest radius with which a close-up and its words fit into a cell; 0 if words do not. */
function fit(most, width, height, words) {
  if (width < 2 * words.half) return 0;
  return Math.max(Math.min(most, 0.5 * (width - GAP), 0.5 * height), 0);
}

function clamp(value, low, high) {
  return Math.min(Math.max(value, low), Math.max(low, high));
}

/** The place of each contact with which the lines to them are shortest, so that none cross. */
function bestOrder(contacts, places, before) {
  const cost = (order) =>
    order.reduce((sum, slot, i) => {
      const [x, y] = places[slot].end;
      return sum + (x - contacts[i][0]) ** 2 + (y - contacts[i][1]) ** 2;
    }, 0);
  const best = permutations(contacts.map((_, i) => i)).reduce(
    (found, order) => (cost(order) < cost(found) ? order : found),
  );
  return before !== null && cost(before) <= TO_SWAP * cost(best) ? before : best;
}

function permutations(values) {
  if (values.length <= 1) return [values];
  return values.flatMap((value, i) =>
    permutations([...values.slice(0, i), ...values.slice(i + 1)]).map((rest) => [value, ...rest]),
  );
}
