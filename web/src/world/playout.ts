// Playout: how far between the last two frames the picture is.
//
// A body is shown on its way from where it was when a frame came to where that frame says that it is, for as long as
// frames are apart. So the picture is one frame late and smooth, whatever the rates of gateway and screen are.

const SHORTEST_S = 1 / 120;
const LONGEST_S = 0.25; // after a gap, bodies jump rather than glide

export class Playout {
  private interval_s = 1 / 30;
  private last_time = NaN; // by the gateway's clock
  private arrived_s = 0;

  arrived(time: number, now_s: number): void {
    const between = time - this.last_time;
    this.last_time = time;
    this.arrived_s = now_s;
    if (!(between > 0)) return;
    const bounded = Math.min(LONGEST_S, Math.max(SHORTEST_S, between));
    this.interval_s += (bounded - this.interval_s) * 0.2;
  }

  // 0: where bodies were, 1: where the newest frame has them.
  fraction(now_s: number): number {
    return Math.min(1, Math.max(0, (now_s - this.arrived_s) / this.interval_s));
  }
}
