// Where a play head gets that runs through a window over and over, at one speed or at a pace that is
// slow where something slips (slipgrasp.web.model.pace).

/** The time [s] after some seconds. playback: {time, start, end, speed, pace: null or [[start, speed], …]}. */
export function advance({ time, start, end, speed, pace }, seconds) {
  if (end <= start) return time;
  const pieces = pace ?? [[start, speed]];
  const pieceAt = (at) => {
    const next = pieces.findIndex(([from]) => from > at);
    const index = next < 0 ? pieces.length - 1 : Math.max(next - 1, 0);
    const until = index + 1 < pieces.length ? pieces[index + 1][0] : end;
    return [Math.min(until, end), pieces[index][1]];
  };
  let duration = 0;
  for (let at = start; at < end; ) {
    const [until, fast] = pieceAt(at);
    duration += (until - at) / fast;
    at = until;
  }
  let left = seconds % duration;
  for (let at = time; ; ) {
    const [until, fast] = pieceAt(at);
    if (at + left * fast < until) return at + left * fast;
    left = Math.max(left - (until - at) / fast, 0);
    at = until < end ? until : start;
  }
}
