// Binary glTF files, made here, as `tessera scene import` writes them.

import { createHash } from 'node:crypto';

export interface GlbMesh {
  positions: number[];
  indices: number[];
  normals?: number[];
  colour?: number[];
}

// `change` may damage the document before it is written.
export function makeGlb(meshes: GlbMesh[], change: (document: any) => void = () => {}): Buffer {
  const parts: Buffer[] = [];
  let size = 0;
  const document: any = { asset: { version: '2.0' }, meshes: [], materials: [], accessors: [], bufferViews: [] };
  const accessor = (bytes: Buffer, componentType: number, type: string, count: number): number => {
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    parts.push(bytes);
    size += bytes.length;
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType, type, count }) - 1;
  };
  const floats = (values: number[]) => accessor(Buffer.from(new Float32Array(values).buffer), 5126, 'VEC3', values.length / 3);
  for (const { positions, indices, normals, colour } of meshes) {
    const primitive: any = { attributes: { POSITION: floats(positions) }, indices: accessor(Buffer.from(new Uint32Array(indices).buffer), 5125, 'SCALAR', indices.length) };
    if (normals) primitive.attributes.NORMAL = floats(normals);
    if (colour) primitive.material = document.materials.push({ pbrMetallicRoughness: { baseColorFactor: [...colour, 1] } }) - 1;
    document.meshes.push({ primitives: [primitive] });
  }
  document.buffers = [{ byteLength: size }];
  change(document);
  const text = JSON.stringify(document);
  const json = Buffer.from(text.padEnd(Math.ceil(text.length / 4) * 4));
  const word = (...values: number[]) => Buffer.from(new Uint32Array(values).buffer);
  return Buffer.concat([word(0x46546c67, 2, 28 + json.length + size, json.length, 0x4e4f534a), json, word(size, 0x004e4942), ...parts]);
}

export function sha256Of(bytes: Buffer): string {
  return createHash('sha256').update(bytes).digest('hex');
}

// A pyramid of this height on a square of side 2.
export function pyramid(height: number, colour?: number[]): GlbMesh {
  return {
    positions: [-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1, 0, height, 0],
    indices: [0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 0, 2, 1, 0, 3, 2],
    ...(colour ? { colour } : {}),
  };
}
