// Values: the values of one property by which bodies are coloured, as they come.

export type Kind = 'none' | 'number' | 'flag' | 'text';

export class Values {
  property = ''; // empty: none is wanted
  low = Infinity; // for numbers; for vectors, their lengths
  high = -Infinity;
  private readonly values = new Map<string, unknown>(); // by id of the body

  begin(property: string): void {
    this.property = property;
    this.clear();
  }

  clear(): void {
    this.values.clear();
    this.low = Infinity;
    this.high = -Infinity;
  }

  // Says whether the range of numbers has grown, so that all bodies look different.
  apply(values: Record<string, unknown>): boolean {
    const { low, high } = this;
    for (const [id, value] of Object.entries(values)) {
      this.values.set(id, value);
      const number = asNumber(value);
      if (number === null) continue;
      this.low = Math.min(this.low, number);
      this.high = Math.max(this.high, number);
    }
    return this.low !== low || this.high !== high;
  }

  get(id: string): unknown {
    return this.values.get(id);
  }

  get kind(): Kind {
    for (const value of this.values.values()) {
      if (typeof value === 'boolean') return 'flag';
      return asNumber(value) === null ? 'text' : 'number';
    }
    return 'none';
  }

  // Where a number lies between the lowest and the highest that came, from 0 to 1; null: it is none.
  fraction(value: unknown): number | null {
    const number = asNumber(value);
    if (number === null) return null;
    return this.high > this.low ? (number - this.low) / (this.high - this.low) : 0.5;
  }
}

function asNumber(value: unknown): number | null {
  if (typeof value === 'number') return value;
  if (Array.isArray(value)) return Math.hypot(...(value as number[]));
  return null;
}
