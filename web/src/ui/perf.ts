// Perf: how long the last pictures took, for the figure on the page and for measurements.

const KEPT = 3000;

export class Perf {
  rate = 0; // pictures a second
  readonly own_ms: number[] = []; // the page's own script, a picture
  readonly whole_ms: number[] = []; // with three.js
  private last_ms = 0;

  reset(): void {
    this.own_ms.length = this.whole_ms.length = 0;
  }

  add(now_ms: number, own_ms: number, whole_ms: number): void {
    if (this.last_ms > 0) this.rate += (1000 / Math.max(1, now_ms - this.last_ms) - this.rate) * 0.05;
    this.last_ms = now_ms;
    this.own_ms.push(own_ms);
    this.whole_ms.push(whole_ms);
    if (this.own_ms.length > KEPT) {
      this.own_ms.shift();
      this.whole_ms.shift();
    }
  }
}
