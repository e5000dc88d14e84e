// Orientations on the wire: the smallest three components of a unit quaternion, 10 bits each, in 32 bits.

const ROOT = Math.SQRT1_2;

// Writes x, y, z, w of `packed` to `out` from index `at`.
export function unpackOrientation(packed: number, out: Float32Array | number[], at: number): void {
  const largest = packed >>> 30;
  const a = (((packed >>> 20) & 1023) / 1023 - 0.5) * 2 * ROOT;
  const b = (((packed >>> 10) & 1023) / 1023 - 0.5) * 2 * ROOT;
  const c = ((packed & 1023) / 1023 - 0.5) * 2 * ROOT;
  const d = Math.sqrt(Math.max(0, 1 - a * a - b * b - c * c));
  out[at] = largest === 0 ? d : a;
  out[at + 1] = largest === 1 ? d : largest === 0 ? a : b;
  out[at + 2] = largest === 2 ? d : largest === 3 ? c : b;
  out[at + 3] = largest === 3 ? d : c;
}

export function packOrientation(quaternion: ArrayLike<number>): number {
  let largest = 0;
  for (let index = 1; index < 4; ++index) {
    if (Math.abs(quaternion[index]!) > Math.abs(quaternion[largest]!)) largest = index;
  }
  const sign = quaternion[largest]! < 0 ? -1 : 1;
  let packed = largest;
  for (let index = 0; index < 4; ++index) {
    if (index === largest) continue;
    const part = Math.round(((sign * quaternion[index]!) / (2 * ROOT) + 0.5) * 1023);
    packed = packed * 1024 + Math.min(1023, Math.max(0, part));
  }
  return packed;
}
