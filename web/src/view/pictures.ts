// Pictures: what meshes are painted with, all in one texture of as many layers, so that meshes of different pictures are
// drawn together.
//
// Each is scaled to the same size, which bounds what it costs: MOST_LAYERS of them take 64 MiB, and a third more for their
// smaller copies. A mesh says at each vertex which layer it is painted with; LAYERLESS is none.

import * as THREE from 'three';
import { pictureSize } from '../protocol/picture.ts';

export const MOST_LAYERS = 64;
export const LAYER_PIXELS = 512; // along a side
export const MOST_SIDE = 4096; // pixels along a side, in a file
export const LAYERLESS = -1;

const LAYER_BYTES = 4 * LAYER_PIXELS * LAYER_PIXELS;

export class PictureError extends Error {}

// Red, green, blue and how opaque, LAYER_PIXELS of them along a side, from the upper left.
export type Decode = (file: Uint8Array, type: string) => Promise<Uint8ClampedArray>;

export class Pictures {
  // To be a uniform of the materials that read it.
  readonly uniform: { value: THREE.DataArrayTexture };
  private readonly layers = new Map<Uint8Array, Promise<number>>(); // by file
  private used = 0;
  private world = 0; // counts what was cleared, so that what comes late for another one is dropped
  private readonly decode: Decode;

  constructor(decode: Decode = decodeInCanvas) {
    this.decode = decode;
    this.uniform = { value: textureOf(new Uint8Array(4), 1, 1) };
  }

  // The layer of this file, which is read once. Throws a PictureError that says why there is none.
  layerOf(file: Uint8Array): Promise<number> {
    let layer = this.layers.get(file);
    if (!layer) {
      layer = this.read(file);
      this.layers.set(file, layer);
    }
    return layer;
  }

  clear(): void {
    ++this.world;
    this.layers.clear();
    this.used = 0;
    this.uniform.value.dispose();
    this.uniform.value = textureOf(new Uint8Array(4), 1, 1);
  }

  private async read(file: Uint8Array): Promise<number> {
    const { layers, world } = this;
    const size = pictureSize(file);
    if (!size) throw new PictureError('it is no PNG or JPEG file');
    if (size.width > MOST_SIDE || size.height > MOST_SIDE) throw new PictureError(`it has ${size.width} x ${size.height} pixels, more than ${MOST_SIDE} along one side`);
    if (layers.size >= MOST_LAYERS) throw new PictureError(`${MOST_LAYERS} others are drawn, which are the most`);
    let pixels: Uint8ClampedArray;
    try {
      pixels = await this.decode(file, size.type);
    } catch {
      throw new PictureError('it is damaged');
    }
    return world === this.world ? this.put(pixels) : LAYERLESS;
  }

  private put(pixels: Uint8ClampedArray): number {
    const room = this.uniform.value.image.depth * (this.used === 0 ? 0 : 1);
    let data = this.uniform.value.image.data as Uint8Array;
    if (this.used === room) {
      const larger = new Uint8Array(LAYER_BYTES * Math.max(1, 2 * room));
      if (this.used > 0) larger.set(data);
      data = larger;
      this.uniform.value.dispose();
      this.uniform.value = textureOf(data, LAYER_PIXELS, Math.max(1, 2 * room));
    }
    data.set(pixels, LAYER_BYTES * this.used);
    this.uniform.value.needsUpdate = true;
    return this.used++;
  }
}

function textureOf(data: Uint8Array, side: number, layers: number): THREE.DataArrayTexture {
  const texture = new THREE.DataArrayTexture(data, side, side, layers);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = THREE.LinearMipmapLinearFilter;
  texture.generateMipmaps = true;
  texture.needsUpdate = true;
  return texture;
}

async function decodeInCanvas(file: Uint8Array, type: string): Promise<Uint8ClampedArray> {
  const bitmap = await createImageBitmap(new Blob([file as BlobPart], { type }), { resizeWidth: LAYER_PIXELS, resizeHeight: LAYER_PIXELS, resizeQuality: 'high', premultiplyAlpha: 'none', colorSpaceConversion: 'none' });
  const canvas = new OffscreenCanvas(LAYER_PIXELS, LAYER_PIXELS);
  const context = canvas.getContext('2d', { willReadFrequently: true })!;
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, LAYER_PIXELS, LAYER_PIXELS).data;
}

// --- Shaders

// For materials whose geometries have the attribute `paint`: place in the picture and its layer.
export const PAINT_VERTEX_HEAD = 'attribute vec3 paint;\nvarying vec3 vPaint;';
export const PAINT_VERTEX = 'vPaint = paint;';
export const PAINT_FRAGMENT_HEAD = `varying vec3 vPaint;
uniform sampler2DArray pictures;
vec3 painted(vec3 colour) {
  vec3 picture = texture(pictures, vec3(vPaint.xy, max(floor(vPaint.z + 0.5), 0.0))).rgb;
  return colour * mix(vec3(1.0), picture, step(-0.5, vPaint.z));
}`;
