// CameraRig: orbits a point, looks from above, follows a body, or chases the player's own.

import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

const CHASE_M = 9;
const TURN_RAD_S = 2.5; // with the stick all the way
const MARGIN = 0.96; // share of half the screen

function fits(place: THREE.Vector3): boolean {
  return Math.abs(place.x) < MARGIN && Math.abs(place.y) < MARGIN;
}

export class CameraRig {
  readonly camera = new THREE.PerspectiveCamera(50, 1, 0.1, 5000);
  readonly controls: OrbitControls;
  private readonly last = new THREE.Vector3();
  private following = false;

  constructor(element: HTMLElement) {
    this.controls = new OrbitControls(this.camera, element);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.maxPolarAngle = Math.PI / 2 - 0.02;
    this.controls.minDistance = 1;
    this.controls.maxDistance = 3000;
    this.controls.zoomToCursor = true;
  }

  // Shows the whole world from a corner, or from straight above.
  frame(bounds: number[], above: boolean): void {
    const centre = [(bounds[0]! + bounds[3]!) / 2, Math.max(0, bounds[1]!), (bounds[2]! + bounds[5]!) / 2];
    const extent = Math.max(bounds[3]! - bounds[0]!, bounds[5]! - bounds[2]!);
    this.following = false;
    const ground = [0, 2].flatMap((x) => [0, 2].map((z) => new THREE.Vector3(bounds[x === 0 ? 0 : 3]!, centre[1]!, bounds[z === 0 ? 2 : 5]!)));
    const way = above ? new THREE.Vector3(0, 1, 0.001) : new THREE.Vector3(0.3, 0.62, 0.8).normalize();
    this.controls.target.set(centre[0]!, centre[1]!, centre[2]!);
    // As near as shows all four corners.
    for (let distance = 0.7 * extent; distance < 6 * extent; distance *= 1.04) {
      this.camera.position.copy(this.controls.target).addScaledVector(way, distance);
      this.controls.update();
      this.adapt();
      this.camera.updateMatrixWorld();
      if (ground.every((corner) => fits(corner.clone().project(this.camera)))) break;
    }
  }

  // The depth buffer's precision goes where it is looked at.
  adapt(): void {
    const distance = this.distance;
    this.camera.near = Math.max(0.05, 0.02 * distance);
    this.camera.far = 40 * distance + 500;
    this.camera.updateProjectionMatrix();
  }

  set(position: number[], target: number[]): void {
    this.following = false;
    this.camera.position.fromArray(position);
    this.controls.target.fromArray(target);
    this.controls.update();
  }

  // Moves with a body at x, y, z, and keeps the side that it is looked at from.
  follow(x: number, y: number, z: number): void {
    const target = this.controls.target;
    if (!this.following) {
      const offset = this.camera.position.clone().sub(target);
      offset.setLength(Math.min(offset.length(), 3 * CHASE_M));
      this.last.set(x, y, z);
      target.copy(this.last);
      this.camera.position.copy(this.last).add(offset);
      this.following = true;
      return;
    }
    const step = new THREE.Vector3(x, y, z).sub(this.last);
    this.last.set(x, y, z);
    target.add(step);
    this.camera.position.add(step);
  }

  stopFollowing(): void {
    this.following = false;
  }

  // Behind and above a player, as a game's camera begins.
  chase(x: number, y: number, z: number): void {
    const back = this.camera.position.clone().sub(this.controls.target).setY(0);
    if (back.lengthSq() < 1e-6) back.set(0, 0, 1);
    back.setLength(CHASE_M);
    this.controls.target.set(x, y, z);
    this.camera.position.set(x + back.x, y + 0.55 * CHASE_M, z + back.z);
    this.last.set(x, y, z);
    this.following = true;
  }

  get target(): number[] {
    return this.controls.target.toArray();
  }

  get distance(): number {
    return this.camera.position.distanceTo(this.controls.target);
  }

  // The direction on the ground that is forward for who looks, as an angle about y; 0 looks along -z.
  get yaw(): number {
    const forward = this.controls.target.clone().sub(this.camera.position);
    return Math.atan2(-forward.x, -forward.z);
  }

  get pitch(): number {
    const forward = this.controls.target.clone().sub(this.camera.position).normalize();
    return Math.asin(forward.y);
  }

  // Turns what is looked at to the right and up, as a stick does: -1 to 1 each.
  turn(right: number, up: number, seconds: number): void {
    const offset = new THREE.Spherical().setFromVector3(this.camera.position.clone().sub(this.controls.target));
    offset.theta -= TURN_RAD_S * seconds * right;
    offset.phi = Math.min(this.controls.maxPolarAngle, Math.max(0.02, offset.phi + TURN_RAD_S * seconds * up));
    this.camera.position.setFromSpherical(offset).add(this.controls.target);
  }

  // Moves over the ground by steps of the screen: right and forward, -1 to 1.
  pan(right: number, forward: number, seconds: number): void {
    const speed = 0.9 * this.camera.position.distanceTo(this.controls.target) * seconds;
    const yaw = this.yaw;
    const step = new THREE.Vector3(
      (right * Math.cos(yaw) - forward * Math.sin(yaw)) * speed,
      0,
      (-right * Math.sin(yaw) - forward * Math.cos(yaw)) * speed,
    );
    this.controls.target.add(step);
    this.camera.position.add(step);
  }
}
