// Binary glTF files, made here, as `tessera scene import` writes them.

import { createHash } from 'node:crypto';
import { deflateSync } from 'node:zlib';

export interface GlbMesh {
  positions: number[];
  indices: number[];
  normals?: number[];
  colour?: number[];
  colours?: number[]; // three a vertex
  places?: number[]; // in the picture
  picture?: Buffer;
}

// `change` may damage the document before it is written.
export function makeGlb(meshes: GlbMesh[], change: (document: any) => void = () => {}): Buffer {
  const parts: Buffer[] = [];
  let size = 0;
  const document: any = { asset: { version: '2.0' }, meshes: [], materials: [], textures: [], images: [], accessors: [], bufferViews: [] };
  const view = (bytes: Buffer): number => {
    const padded = Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4)]);
    parts.push(padded);
    size += padded.length;
    return document.bufferViews.push({ buffer: 0, byteOffset: size - padded.length, byteLength: bytes.length }) - 1;
  };
  const accessor = (bytes: Buffer, componentType: number, type: string, count: number): number => document.accessors.push({ bufferView: view(bytes), componentType, type, count }) - 1;
  const floats = (values: number[], parts = 3) => accessor(Buffer.from(new Float32Array(values).buffer), 5126, `VEC${parts}`, values.length / parts);
  for (const { positions, indices, normals, colour, colours, places, picture } of meshes) {
    const primitive: any = { attributes: { POSITION: floats(positions) }, indices: accessor(Buffer.from(new Uint32Array(indices).buffer), 5125, 'SCALAR', indices.length) };
    if (normals) primitive.attributes.NORMAL = floats(normals);
    if (colours) primitive.attributes.COLOR_0 = floats(colours);
    if (places) primitive.attributes.TEXCOORD_0 = floats(places, 2);
    const rough: any = colour ? { baseColorFactor: [...colour, 1] } : {};
    if (picture) {
      const source = document.images.push({ bufferView: view(picture), mimeType: 'image/png' }) - 1;
      rough.baseColorTexture = { index: document.textures.push({ source }) - 1 };
    }
    if (colour || picture) primitive.material = document.materials.push({ pbrMetallicRoughness: rough }) - 1;
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

// A PNG file of this size, whose pixels are what `colour` gives, red, green and blue from 0 to 255.
export function makePng(width: number, height: number, colour: (x: number, y: number) => number[]): Buffer {
  const chunk = (type: string, data: Buffer) => {
    const named = Buffer.concat([Buffer.from(type, 'latin1'), data]);
    return Buffer.concat([bigWord(data.length), named, bigWord(crc(named))]);
  };
  const rows: number[] = [];
  for (let y = 0; y < height; ++y) {
    rows.push(0); // as they are
    for (let x = 0; x < width; ++x) rows.push(...colour(x, y));
  }
  const head = Buffer.concat([bigWord(width), bigWord(height), Buffer.from([8, 2, 0, 0, 0])]);
  return Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), chunk('IHDR', head), chunk('IDAT', deflateSync(Buffer.from(rows))), chunk('IEND', Buffer.alloc(0))]);
}

function bigWord(value: number): Buffer {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32BE(value >>> 0);
  return bytes;
}

// As PNG has it (ISO 15948, annex D).
function crc(bytes: Buffer): number {
  let rest = 0xffffffff;
  for (const byte of bytes) {
    rest ^= byte;
    for (let bit = 0; bit < 8; ++bit) rest = rest & 1 ? 0xedb88320 ^ (rest >>> 1) : rest >>> 1;
  }
  return rest ^ 0xffffffff;
}
