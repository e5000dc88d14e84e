// Contacts: a mark that fades where a player or a trigger met something.

import * as THREE from 'three';
import type { Met } from '../protocol/messages.ts';

const SHOWN_S = 0.6;
const MOST = 128; // a second has 100 at most; a newer one takes the place of the oldest
const SIZE_PX = 9;
const BEGAN = [1, 0.72, 0.2];
const ENTERED = [0.37, 0.88, 0.75];

export class Contacts {
  readonly points: THREE.Points;
  count = 0; // marks that have not faded
  private readonly places = new Float32Array(3 * MOST);
  private readonly colours = new Float32Array(4 * MOST);
  private readonly begin_s = new Float64Array(MOST).fill(-Infinity);
  private next = 0;

  constructor() {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.places, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(this.colours, 4));
    const material = new THREE.PointsMaterial({
      size: SIZE_PX,
      sizeAttenuation: false,
      vertexColors: true,
      transparent: true,
      depthTest: false,
    });
    this.points = new THREE.Points(geometry, material);
    this.points.frustumCulled = false; // its points are everywhere
    this.points.visible = false;
    this.points.renderOrder = 3;
  }

  // `place`: of the body, where the message has no point. That a contact ends leaves no mark.
  add(met: Met, place: ArrayLike<number> | null): void {
    const at = met.point ?? place;
    if (!at || met.kind === 'contact_ended' || met.kind === 'trigger_left') return;
    const slot = this.next;
    this.next = (slot + 1) % MOST;
    for (let axis = 0; axis < 3; ++axis) this.places[3 * slot + axis] = at[axis]!;
    this.colours.set(met.kind === 'trigger_entered' ? ENTERED : BEGAN, 4 * slot);
    this.begin_s[slot] = Infinity; // when it is first drawn, so that a slow machine shows it too
    this.points.geometry.getAttribute('position').needsUpdate = true;
  }

  fade(now_s: number): void {
    this.count = 0;
    for (let slot = 0; slot < MOST; ++slot) {
      if (this.begin_s[slot] === Infinity) this.begin_s[slot] = now_s;
      const left = 1 - (now_s - this.begin_s[slot]!) / SHOWN_S;
      this.colours[4 * slot + 3] = Math.max(0, left);
      if (left > 0) ++this.count;
    }
    if (this.count === 0 && !this.points.visible) return;
    this.points.visible = this.count > 0;
    this.points.geometry.getAttribute('color').needsUpdate = true;
  }

  clear(): void {
    this.begin_s.fill(-Infinity);
    this.fade(0);
  }
}
