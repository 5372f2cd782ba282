// Points of the scene on the screen. Matrices have 16 numbers, column by column, as in WebGL.

/** The matrix of `second`, then `first`. */
export function multiply(first, second) {
  const product = new Array(16);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += first[4 * k + row] * second[4 * column + k];
      product[4 * column + row] = sum;
    }
  }
  return product;
}

/** Where a point is on a picture of a size, from its upper left corner [px]; null behind the eye. */
export function project(toClip, [x, y, z], { width, height }) {
  const [right, up, , depth] = [0, 1, 2, 3].map(
    (row) => toClip[row] * x + toClip[4 + row] * y + toClip[8 + row] * z + toClip[12 + row],
  );
  if (depth <= 0) return null;
  return [0.5 * (1 + right / depth) * width, 0.5 * (1 - up / depth) * height];
}

/** The box around points ``[x, y, z, x, …]`` on a picture; null if the eye sees none of them. */
export function boxOf(toClip, points, size) {
  const box = { left: Infinity, top: Infinity, right: -Infinity, bottom: -Infinity };
  for (let k = 0; k < points.length; k += 3) {
    const seen = project(toClip, points.subarray(k, k + 3), size);
    if (seen === null) continue;
    box.left = Math.min(box.left, seen[0]);
    box.right = Math.max(box.right, seen[0]);
    box.top = Math.min(box.top, seen[1]);
    box.bottom = Math.max(box.bottom, seen[1]);
  }
  return box.left === Infinity ? null : box;
}
