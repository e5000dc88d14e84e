// Reads the numbers of a binary message (docs/viewer_protocol.md) in order. Whatever is wrong with a message throws a
// ProtocolError that names the place; nothing is read past its end.

export class ProtocolError extends Error {}

const TEXT = new TextDecoder('utf-8', { fatal: true });

export class Reader {
  // The halves of the last number that varint64 read, unsigned.
  high = 0;
  low = 0;
  at = 0;
  private readonly bytes: Uint8Array;
  private readonly view: DataView;

  constructor(data: ArrayBuffer | Uint8Array) {
    this.bytes = data instanceof Uint8Array ? data : new Uint8Array(data);
    this.view = new DataView(this.bytes.buffer, this.bytes.byteOffset, this.bytes.byteLength);
  }

  get left(): number {
    return this.bytes.length - this.at;
  }

  fail(text: string): never {
    throw new ProtocolError(`byte ${this.at} of ${this.bytes.length}: ${text}`);
  }

  private take(size: number): number {
    if (this.left < size) this.fail(`the message ends within a field of ${size} bytes`);
    const begin = this.at;
    this.at += size;
    return begin;
  }

  u8(): number {
    return this.view.getUint8(this.take(1));
  }

  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }

  f32(): number {
    return this.finite(this.view.getFloat32(this.take(4), true));
  }

  f64(): number {
    return this.finite(this.view.getFloat64(this.take(8), true));
  }

  private finite(value: number): number {
    if (!Number.isFinite(value)) this.fail('a number that is not finite');
    return value;
  }

  // An unsigned LEB128 of at most 10 bytes into `high` and `low`.
  varint64(): void {
    let low = 0;
    let high = 0;
    for (let index = 0; index < 10; ++index) {
      const byte = this.u8();
      const bits = byte & 127;
      const shift = 7 * index;
      if (shift < 28) {
        low |= bits << shift;
      } else if (shift === 28) {
        low |= bits << 28;
        high |= bits >>> 4;
      } else {
        if (shift === 63 && bits > 1) this.fail('a varint of more than 64 bits');
        high |= bits << (shift - 32);
      }
      if (byte < 128) {
        this.low = low >>> 0;
        this.high = high >>> 0;
        return;
      }
    }
    this.fail('a varint of more than 10 bytes');
  }

  // A varint that a JavaScript number holds exactly.
  varint(): number {
    const first = this.at < this.bytes.length ? this.bytes[this.at]! : 128;
    if (first < 128) {
      ++this.at;
      return first;
    }
    this.varint64();
    if (this.high >= 1 << 21) this.fail('a number above 2^53');
    return this.high * 4294967296 + this.low;
  }

  signed(): number {
    const value = this.varint();
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  }

  // A count of things that take at least `bytes_each` each, so that a lie cannot make anybody reserve memory.
  count(bytes_each: number): number {
    const count = this.varint();
    if (count * bytes_each > this.left) this.fail(`${count} things of at least ${bytes_each} bytes do not fit`);
    return count;
  }

  text(): string {
    const size = this.count(1);
    const begin = this.take(size);
    try {
      return TEXT.decode(this.bytes.subarray(begin, begin + size));
    } catch {
      return this.fail('a text that is not UTF-8');
    }
  }

  bytesOf(count: number): Uint8Array {
    const begin = this.take(count);
    return this.bytes.subarray(begin, begin + count);
  }

  f32s(count: number): Float32Array {
    const begin = this.take(4 * count);
    const values = new Float32Array(count);
    for (let index = 0; index < count; ++index) {
      values[index] = this.finite(this.view.getFloat32(begin + 4 * index, true));
    }
    return values;
  }

  f64s(count: number): number[] {
    const values: number[] = [];
    for (let index = 0; index < count; ++index) values.push(this.f64());
    return values;
  }

  u32s(count: number): Uint32Array {
    const begin = this.take(4 * count);
    const values = new Uint32Array(count);
    for (let index = 0; index < count; ++index) values[index] = this.view.getUint32(begin + 4 * index, true);
    return values;
  }

  end(): void {
    if (this.left > 0) this.fail(`${this.left} bytes too many`);
  }
}
