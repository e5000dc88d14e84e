// Picking: which body is at a place of the screen.

import * as THREE from 'three';
import { type Bodies, POSE_PARTS, TURN } from '../world/bodies.ts';
import type { Batches } from './batches.ts';

const NEAR_MISS = 0.012; // share of the distance: small bodies can be clicked too

export function pick(ray: THREE.Ray, bodies: Bodies, batches: Batches, level: THREE.Object3D): number {
  const caster = new THREE.Raycaster();
  caster.ray.copy(ray);
  const wall = caster.intersectObject(level, true)[0]?.distance ?? Infinity;
  const candidates: { slot: number; along: number; miss: number }[] = [];
  const centre = new THREE.Vector3();
  for (let place = 0; place < bodies.count; ++place) {
    const slot = bodies.order[place]!;
    centre.fromArray(bodies.shown, POSE_PARTS * slot);
    const along = centre.clone().sub(ray.origin).dot(ray.direction);
    const radius = batches.geometryOf(slot)?.boundingSphere?.radius ?? 0;
    const miss = ray.distanceToPoint(centre);
    if (along > 0 && along - radius < wall && miss < radius + NEAR_MISS * along) candidates.push({ slot, along, miss });
  }
  candidates.sort((a, b) => a.along - b.along);
  const mesh = new THREE.Mesh(undefined, new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }));
  let best = -1;
  let nearest = wall;
  for (const { slot } of candidates.slice(0, 64)) {
    mesh.geometry = batches.geometryOf(slot)!;
    mesh.position.fromArray(bodies.shown, POSE_PARTS * slot);
    mesh.quaternion.fromArray(bodies.shown, POSE_PARTS * slot + TURN);
    mesh.updateMatrixWorld();
    const hit = caster.intersectObject(mesh)[0];
    if (hit && hit.distance < nearest) {
      nearest = hit.distance;
      best = slot;
    }
  }
  if (best >= 0) return best;
  candidates.sort((a, b) => a.miss / a.along - b.miss / b.along);
  return candidates[0]?.slot ?? -1;
}
