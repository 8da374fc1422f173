/** Where the robots of a system are: their pages, and a map around them. */

const MARGIN = 1; // [m] around the robots

/** Returns the address of a robot's page: one without a host is on the machine that serves this page. */
export function pageOf(address: string, here: { protocol: string; hostname: string }): string {
  return `${here.protocol}//${address.startsWith(":") ? here.hostname : ""}${address}/`;
}

/** Returns the square around poses, in the coordinates of a drawing: y points down [m]. */
export function frameOf(poses: readonly { x: number; y: number }[]) {
  const xs = poses.map(({ x }) => x);
  const ys = poses.map(({ y }) => -y);
  const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const size = Math.max(right - left, bottom - top) + 2 * MARGIN;
  return { left: (left + right - size) / 2, top: (top + bottom - size) / 2, size };
}

/** Returns the lines at whole metres within a square; at multiples of ten, if there were too many. */
export function gridOf(left: number, top: number, size: number): string {
  const step = 10 ** Math.max(0, Math.ceil(Math.log10(size / 20)));
  const inside = (from: number) =>
    Array.from({ length: Math.floor(size / step) + 1 }, (_, turn) => (Math.ceil(from / step) + turn) * step).filter(
      (at) => at <= from + size,
    );
  return [
    ...inside(left).map((x) => `M${x} ${top}v${size}`),
    ...inside(top).map((y) => `M${left} ${y}h${size}`),
  ].join("");
}
