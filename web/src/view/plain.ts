// Plain light: how the world is lit where no graphics card draws it.
//
// It is the light of three.js's Lambert material, of one sky and one sun without shadows, but it is computed for each
// vertex, and what is drawn is computed in the screen's own colours: a pixel costs a multiplication and a mix with the fog.
// The screen's curve is taken for a power of 2.2, so products of colours may be taken after it.

import * as THREE from 'three';
import { PACK_VERTEX_HEAD, type PackUniforms } from './packs.ts';

const GAMMA = 2.2;

export class PlainLight {
  readonly uniforms = {
    skyLight: { value: new THREE.Color() },
    groundLight: { value: new THREE.Color() },
    sunLight: { value: new THREE.Color() },
    towardsSun: { value: new THREE.Vector3(0, 1, 0) },
    fogShown: { value: new THREE.Vector3() },
    fogReach: { value: new THREE.Vector2(1e6, 1e7) },
  };

  // As the lights and the fog are now.
  follow(sky: THREE.HemisphereLight, sun: THREE.DirectionalLight, fog: THREE.Fog): void {
    const { skyLight, groundLight, sunLight, towardsSun, fogShown, fogReach } = this.uniforms;
    skyLight.value.copy(sky.color).multiplyScalar(sky.intensity / Math.PI);
    groundLight.value.copy(sky.groundColor).multiplyScalar(sky.intensity / Math.PI);
    sunLight.value.copy(sun.color).multiplyScalar(sun.intensity / Math.PI);
    towardsSun.value.subVectors(sun.position, sun.target.position).normalize();
    fogShown.value.copy(shown(fog.color));
    fogReach.value.set(fog.near, fog.far);
  }
}

// A colour as the screen is told.
export function shown(colour: THREE.Color): THREE.Vector3 {
  const screen = colour.clone().convertLinearToSRGB();
  return new THREE.Vector3(screen.r, screen.g, screen.b);
}

const LIGHT = `
uniform vec3 skyLight, groundLight, sunLight, towardsSun;
vec3 lit(vec3 normal) {
  return mix(groundLight, skyLight, 0.5 * normal.y + 0.5) + sunLight * max(dot(normal, towardsSun), 0.0);
}
vec3 onScreen(vec3 linear) { return pow(linear, vec3(${(1 / GAMMA).toFixed(6)})); }`;

// For packs of bodies.
export function plainBodies(light: PlainLight, pack: PackUniforms): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    uniforms: { ...light.uniforms, ...pack },
    vertexShader: `${PACK_VERTEX_HEAD}
${LIGHT}
uniform vec3 fogShown;
uniform vec2 fogReach;
varying vec3 vShown;
void main() {
  if (!readBody()) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  gl_Position = projectionMatrix * (viewMatrix * vec4(bodyPlace + turned(position), 1.0));
  vShown = mix(onScreen(bodyColour * lit(turned(normal))), fogShown, smoothstep(fogReach.x, fogReach.y, gl_Position.w));
}`,
    fragmentShader: `varying vec3 vShown;
void main() { gl_FragColor = vec4(vShown, 1.0); }`,
  });
}

// For the level: colours of the picture of the territory, which has to give them as the screen is told, \`bright\` times as
// light. \`uniforms\` are those of Level.
export function plainLevel(light: PlainLight, uniforms: Record<string, THREE.IUniform>, bright: number): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    side: THREE.DoubleSide,
    uniforms: { ...light.uniforms, ...uniforms },
    vertexShader: `${LIGHT}
uniform vec4 area;
varying vec2 vPlace;
varying vec3 vFront, vBack;
varying float vDepth;
void main() {
  vec4 placed = vec4(position, 1.0);
  vec3 turned = normal;
  #ifdef USE_INSTANCING
    placed = instanceMatrix * placed;
    turned = mat3(instanceMatrix) * turned;
  #endif
  placed = modelMatrix * placed;
  turned = mat3(modelMatrix) * turned;
  vPlace = (placed.xz - area.xy) * area.zw;
  vFront = onScreen(${bright.toFixed(2)} * lit(turned));
  vBack = onScreen(${bright.toFixed(2)} * lit(-turned));
  gl_Position = projectionMatrix * (viewMatrix * placed);
  vDepth = gl_Position.w;
}`,
    fragmentShader: `uniform sampler2D territory;
uniform vec3 outsideShown, fogShown;
uniform vec2 fogReach;
varying vec2 vPlace;
varying vec3 vFront, vBack;
varying float vDepth;
void main() {
  vec2 within = step(vec2(0.0), vPlace) * step(vPlace, vec2(1.0));
  vec3 ground = mix(outsideShown, texture2D(territory, vPlace).rgb, within.x * within.y);
  gl_FragColor = vec4(mix(ground * (gl_FrontFacing ? vFront : vBack), fogShown, smoothstep(fogReach.x, fogReach.y, vDepth)), 1.0);
}`,
  });
}
