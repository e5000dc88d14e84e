// Labels: names of players above their bodies, as text over the picture.

import { type Bodies, POSE_PARTS } from '../world/bodies.ts';
import type { WorldView } from '../view/world_view.ts';
import { h, setText } from './dom.ts';

const MOST = 32;

export class Labels {
  readonly element = h('div', { id: 'labels', 'aria-hidden': true });
  private readonly pool: HTMLElement[] = [];
  private players: number[] = []; // slots
  stale = true; // bodies came or went

  draw(bodies: Bodies, view: WorldView, names: Map<number, string>): void {
    if (this.stale) {
      this.stale = false;
      this.players = [];
      for (let place = 0; place < bodies.count && this.players.length < MOST; ++place) {
        const slot = bodies.order[place]!;
        if (bodies.player[slot]! > 0) this.players.push(slot);
      }
    }
    this.players.forEach((slot, index) => {
      const label = (this.pool[index] ??= this.element.appendChild(h('span')));
      const at = POSE_PARTS * slot;
      const place = view.project(bodies.shown[at]!, bodies.shown[at + 1]! + 1.4, bodies.shown[at + 2]!);
      label.hidden = !place;
      if (!place) return;
      setText(label, names.get(bodies.player[slot]!) ?? `player ${bodies.player[slot]}`);
      label.style.transform = `translate(-50%, -100%) translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
    });
    for (let index = this.players.length; index < this.pool.length; ++index) this.pool[index]!.hidden = true;
  }
}
