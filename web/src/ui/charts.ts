// Charts of the last five minutes, one line a region.

import uPlot from 'uplot';
import type { RegionStatus } from '../protocol/messages.ts';
import { regionCss } from '../view/colours.ts';
import { KEPT_S, type Room } from '../world/room.ts';
import { h } from './dom.ts';

interface Figure {
  title: string;
  value: (region: RegionStatus) => number;
}

const FIGURES: Figure[] = [
  { title: 'Step p99, ms', value: (region) => region.step_p99_ms },
  { title: 'Bodies', value: (region) => region.bodies },
  { title: 'Ticks a second', value: (region) => region.tick_rate_hz },
];
const HEIGHT = 92;

export class Charts {
  readonly element = h('div', { class: 'charts' });
  private plots: uPlot[] = [];
  private regions = '';
  private dark = true;

  setTheme(dark: boolean): void {
    this.dark = dark;
    this.regions = '';
  }

  draw(room: Room, now_s: number): void {
    const width = this.element.clientWidth;
    if (width === 0) return;
    const numbers = [...new Set(room.samples.flatMap((sample) => [...sample.regions.keys()]))].sort((a, b) => a - b);
    const key = `${numbers.join()} ${width} ${this.dark}`;
    if (key !== this.regions) {
      this.regions = key;
      this.make(numbers, width);
    }
    // Time counts back from now, so that the right edge is the present.
    const times = room.samples.map((sample) => sample.time_s - now_s);
    FIGURES.forEach((figure, index) => {
      const lines = numbers.map((number) =>
        room.samples.map((sample) => {
          const region = sample.regions.get(number);
          return region?.alive ? figure.value(region) : null;
        }),
      );
      this.plots[index]?.setData([times, ...lines], true);
    });
  }

  private make(numbers: number[], width: number): void {
    for (const plot of this.plots) plot.destroy();
    this.element.replaceChildren();
    const ink = this.dark ? '#8b96a9' : '#5b6675';
    const line = this.dark ? 'rgba(255,255,255,.07)' : 'rgba(0,0,0,.09)';
    const axis = { stroke: ink, font: '10px system-ui', grid: { stroke: line, width: 1 }, ticks: { show: false } };
    this.plots = FIGURES.map((figure) => {
      const box = h('figure', {}, h('figcaption', {}, figure.title));
      this.element.append(box);
      const options: uPlot.Options = {
        width,
        height: HEIGHT,
        legend: { show: false },
        cursor: { show: false },
        padding: [6, 14, 0, 0],
        scales: { x: { time: false, range: [-KEPT_S, 0] }, y: { range: (_, low, high) => [Math.min(0, low), high * 1.12 + 0.1] } },
        axes: [
          { ...axis, size: 16, gap: 2, values: (_, splits) => splits.map((at) => (at === 0 ? 'now' : `${at / 60} min`)), splits: () => [-240, -180, -120, -60, 0] },
          { ...axis, size: 38, gap: 4, space: 24 },
        ],
        series: [
          {},
          ...numbers.map((number) => ({ stroke: regionCss(number), width: 1.5, points: { show: false }, spanGaps: false })),
        ],
      };
      return new uPlot(options, [[], ...numbers.map(() => [])], box);
    });
  }
}
