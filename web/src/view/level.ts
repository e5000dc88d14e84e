// Level: the bodies that never move, coloured by who owns the ground below them.

import * as THREE from 'three';
import type { StaticBody } from '../protocol/messages.ts';
import { type ShapeTable, makeGeometry } from './geometry.ts';
import type { Territory, Theme } from './territory.ts';

const GROUND = new THREE.PlaneGeometry(4000, 4000).rotateX(-Math.PI / 2);

export class Level {
  readonly group = new THREE.Group();
  private readonly uniforms;
  private readonly ground: THREE.MeshLambertMaterial;
  private readonly solid: THREE.MeshLambertMaterial;
  private readonly trigger = new THREE.MeshLambertMaterial({
    color: '#5ee0c0',
    transparent: true,
    opacity: 0.22,
    depthWrite: false,
  });
  private readonly geometries = new Map<number, THREE.BufferGeometry>();
  private readonly floor: THREE.Mesh;
  private has_plane = false;

  constructor(territory: Territory) {
    this.uniforms = {
      territory: { value: territory.texture },
      area: { value: territory.area },
      outside: { value: new THREE.Color() },
    };
    this.ground = this.material(1);
    this.solid = this.material(1.9);
    this.floor = new THREE.Mesh(GROUND, this.ground);
    this.group.add(this.floor);
  }

  get count(): number {
    return this.group.children.length - 1;
  }

  // Colours what is lit by the picture of the territory, `bright` times as light as the ground.
  private material(bright: number): THREE.MeshLambertMaterial {
    const material = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide });
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', '#include <common>\nvarying vec3 vWorld;')
        .replace('#include <project_vertex>', '#include <project_vertex>\nvWorld = (modelMatrix * vec4(transformed, 1.0)).xyz;');
      shader.fragmentShader = shader.fragmentShader
        .replace(
          '#include <common>',
          '#include <common>\nvarying vec3 vWorld;\nuniform sampler2D territory;\nuniform vec4 area;\nuniform vec3 outside;',
        )
        .replace(
          '#include <color_fragment>',
          `vec2 place = (vWorld.xz - area.xy) * area.zw;
           vec2 within = step(vec2(0.0), place) * step(place, vec2(1.0));
           diffuseColor.rgb = mix(outside, texture2D(territory, place).rgb, within.x * within.y) * ${bright.toFixed(2)};`,
        );
    };
    material.customProgramCacheKey = () => `territory ${bright}`;
    return material;
  }

  setTheme(theme: Theme): void {
    this.uniforms.outside.value.set(theme.ground).multiplyScalar(0.8);
  }

  add(body: StaticBody, shapes: ShapeTable): void {
    const shape = shapes.get(body.shape);
    if (!shape) return;
    let geometry = this.geometries.get(body.shape);
    if (!geometry) {
      geometry = makeGeometry(shape, shapes, true);
      this.geometries.set(body.shape, geometry);
    }
    const flat = shape.kind === 'plane' || shape.kind === 'field';
    const mesh = new THREE.Mesh(geometry, body.trigger ? this.trigger : flat ? this.ground : this.solid);
    mesh.position.fromArray(body.position);
    mesh.quaternion.fromArray(body.orientation);
    mesh.receiveShadow = !body.trigger;
    mesh.castShadow = !body.trigger && !flat;
    mesh.updateMatrixWorld();
    mesh.matrixAutoUpdate = false;
    mesh.name = body.name;
    this.group.add(mesh);
    if (shape.kind === 'plane') this.has_plane = true;
    this.placeFloor();
  }

  // A world without a plane gets a floor just below all that it has, so that depth can be read.
  private placeFloor(): void {
    this.floor.visible = !this.has_plane;
    if (this.has_plane) return;
    const box = new THREE.Box3();
    for (const child of this.group.children) if (child !== this.floor) box.expandByObject(child);
    this.floor.position.y = box.isEmpty() ? 0 : box.min.y - 0.02;
  }

  clear(): void {
    for (const child of [...this.group.children]) if (child !== this.floor) this.group.remove(child);
    for (const geometry of this.geometries.values()) geometry.dispose();
    this.geometries.clear();
    this.has_plane = false;
    this.floor.visible = true;
    this.floor.position.y = 0;
  }
}
