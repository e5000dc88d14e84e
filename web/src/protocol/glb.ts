// Reads the meshes of a binary glTF 2.0 file (.glb): positions, normals, triangles and colours of each primitive, and the
// picture that it is painted with, which is not decoded here.
// Pure: bytes in, meshes or a GlbError out. Everything lies in the file itself, and whatever names another is refused, so
// that no file makes the page ask another host.

export class GlbError extends Error {}

export interface Primitive {
  positions: Float32Array;
  normals: Float32Array | null; // null: there are none
  indices: Uint32Array; // three a triangle
  colour: number[]; // red, green and blue, linear, 0 to 1
  colours: Float32Array | null; // each vertex has one, to be multiplied with it; null: there are none
  places: Float32Array | null; // two a vertex, in the picture, from the upper left
  picture: Uint8Array | null; // a file within the file: the same object for all that are painted with it
}

export const MOST_BYTES = 64 << 20;
export const MOST_TRIANGLES = 1_000_000; // in a file

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
const TRIANGLES = 4;
const FLOAT = 5126;
const SHARE_BYTES: Record<number, number> = { 5121: 1, 5123: 2 }; // integers that stand for 0 to 1
const INDEX_BYTES: Record<number, number> = { 5121: 1, 5123: 2, 5125: 4 };

type Json = Record<string, unknown>;

// Meshes in the order of the file's `meshes`.
export function parseGlb(data: ArrayBuffer): Primitive[][] {
  if (data.byteLength > MOST_BYTES) throw new GlbError(`it has ${data.byteLength} bytes, more than ${MOST_BYTES}`);
  const { document, binary } = chunks(data);
  const file = new File(document, binary);
  return list(document, 'meshes').map((_, mesh) => file.mesh(mesh));
}

function chunks(data: ArrayBuffer): { document: Json; binary: DataView } {
  const view = new DataView(data);
  if (data.byteLength < 20 || view.getUint32(0, true) !== MAGIC) throw new GlbError('it is no binary glTF file');
  if (view.getUint32(4, true) !== 2) throw new GlbError(`it has version ${view.getUint32(4, true)}, not 2`);
  if (view.getUint32(8, true) !== data.byteLength) throw new GlbError('it is cut short');
  const size = view.getUint32(12, true);
  if (view.getUint32(16, true) !== JSON_CHUNK || size > data.byteLength - 20) throw new GlbError('it has no document');
  let document: unknown;
  try {
    document = JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(new Uint8Array(data, 20, size)));
  } catch {
    throw new GlbError('its document is no JSON');
  }
  if (typeof document !== 'object' || document === null || Array.isArray(document)) throw new GlbError('its document is no object');
  const at = 20 + size;
  if (at + 8 > data.byteLength) return { document: document as Json, binary: new DataView(data, 0, 0) };
  const bytes = view.getUint32(at, true);
  if (view.getUint32(at + 4, true) !== BINARY_CHUNK || bytes > data.byteLength - at - 8) throw new GlbError('its buffer is cut short');
  return { document: document as Json, binary: new DataView(data, at + 8, bytes) };
}

function list(of: Json, name: string): Json[] {
  const value = of[name];
  if (value === undefined) return [];
  if (!Array.isArray(value)) throw new GlbError(`${name} is no list`);
  return value as Json[];
}

function entry(of: Json, name: string, index: unknown): Json {
  const found = typeof index === 'number' && Number.isInteger(index) ? list(of, name)[index] : undefined;
  if (typeof found !== 'object' || found === null) throw new GlbError(`${name}[${String(index)}] is missing`);
  return found;
}

// A whole number from 0 on.
function whole(of: Json, name: string, otherwise?: number): number {
  const value = of[name] ?? otherwise;
  if (typeof value !== 'number' || !Number.isSafeInteger(value) || value < 0) throw new GlbError(`${name} is no whole number`);
  return value;
}

// Parts of each element by its type.
const PARTS: Record<string, number> = { VEC2: 2, VEC3: 3, VEC4: 4 };

interface Elements {
  begin: number; // in the buffer
  stride: number;
  count: number;
  component: number;
}

class File {
  private triangles = 0;
  private readonly files = new Map<Json, Uint8Array>(); // by image

  constructor(
    private readonly document: Json,
    private readonly binary: DataView,
  ) {}

  mesh(number: number): Primitive[] {
    const primitives = list(entry(this.document, 'meshes', number), 'primitives');
    return primitives.map((primitive, at) => {
      try {
        return this.primitive(primitive);
      } catch (error) {
        throw error instanceof GlbError ? new GlbError(`meshes[${number}].primitives[${at}]: ${error.message}`) : error;
      }
    });
  }

  private primitive(primitive: Json): Primitive {
    if (typeof primitive !== 'object' || primitive === null) throw new GlbError('is no object');
    if (whole(primitive, 'mode', TRIANGLES) !== TRIANGLES) throw new GlbError('mode is not that of triangles');
    const attributes = (primitive['attributes'] ?? {}) as Json;
    const positions = this.numbers(attributes['POSITION'], ['VEC3']);
    const vertices = positions.length / 3;
    const indices = this.indices(primitive['indices'], vertices);
    const all = (name: string, types: string[], integers: boolean) => {
      if (attributes[name] === undefined) return null;
      const values = this.numbers(attributes[name], types, integers);
      if (values.length !== vertices * PARTS[types[0]!]!) throw new GlbError(`has not as many of ${name} as positions`);
      return values;
    };
    const { material } = primitive;
    const texture = this.rough(material)?.['baseColorTexture'] as Json | undefined;
    const places = texture ? all(`TEXCOORD_${whole(texture, 'texCoord', 0)}`, ['VEC2'], true) : null;
    const picture = texture && places ? this.picture(texture) : null;
    const colours = all('COLOR_0', ['VEC3', 'VEC4'], true);
    return { positions, normals: all('NORMAL', ['VEC3'], false), indices, colour: this.colour(material), colours, places: picture && places, picture };
  }

  private elements(index: unknown, type: string, components: (component: number) => number): Elements {
    const accessor = entry(this.document, 'accessors', index);
    if (accessor['sparse'] !== undefined) throw new GlbError('is sparse');
    const component = whole(accessor, 'componentType');
    const size = components(component);
    if (accessor['type'] !== type || size === 0) throw new GlbError(`accessors[${String(index)}] has another type`);
    const { begin: first, end, stride: apart } = this.view(accessor['bufferView']);
    const count = whole(accessor, 'count');
    const stride = apart || size;
    const begin = first + whole(accessor, 'byteOffset', 0);
    const fits = end <= this.binary.byteLength && stride >= size && stride <= 255;
    if (!fits || (count > 0 && begin + (count - 1) * stride + size > end)) throw new GlbError(`accessors[${String(index)}] ends beyond its buffer`);
    return { begin, stride, count, component };
  }

  // Where it begins and ends, which may be beyond the buffer.
  private view(index: unknown): { begin: number; end: number; stride: number } {
    const view = entry(this.document, 'bufferViews', index);
    const buffer = entry(this.document, 'buffers', view['buffer']);
    if (view['buffer'] !== 0 || buffer['uri'] !== undefined) throw new GlbError('its buffer is another file');
    const begin = whole(view, 'byteOffset', 0);
    return { begin, end: begin + whole(view, 'byteLength'), stride: whole(view, 'byteStride', 0) };
  }

  // Elements may be of any of these types, and give as many parts as the first of them has: floats, or with `integers` such
  // as stand for 0 to 1 too.
  private numbers(index: unknown, types: string[], integers = false): Float32Array {
    const type = types.find((one) => one === entry(this.document, 'accessors', index)['type']) ?? types[0]!;
    const size = (component: number) => (component === FLOAT ? 4 : integers ? (SHARE_BYTES[component] ?? 0) : 0);
    const { begin, stride, count, component } = this.elements(index, type, (of) => PARTS[type]! * size(of));
    const parts = PARTS[types[0]!]!;
    const values = new Float32Array(parts * count);
    for (let at = 0; at < count; ++at) {
      for (let part = 0; part < parts; ++part) {
        const value = this.number(begin + at * stride + part * size(component), component);
        if (!Number.isFinite(value)) throw new GlbError(`accessors[${String(index)}] has a number that is not finite`);
        values[parts * at + part] = value;
      }
    }
    return values;
  }

  private number(place: number, component: number): number {
    if (component === FLOAT) return this.binary.getFloat32(place, true);
    return component === 5121 ? this.binary.getUint8(place) / 0xff : this.binary.getUint16(place, true) / 0xffff;
  }

  private indices(index: unknown, vertices: number): Uint32Array {
    const from = index === undefined ? null : this.elements(index, 'SCALAR', (component) => INDEX_BYTES[component] ?? 0);
    const count = from?.count ?? vertices;
    this.triangles += Math.floor(count / 3);
    if (this.triangles > MOST_TRIANGLES) throw new GlbError(`the file has more than ${MOST_TRIANGLES} triangles`);
    const values = new Uint32Array(count - (count % 3));
    for (let at = 0; at < values.length; ++at) {
      values[at] = from ? this.index(from, at) : at;
      if (values[at]! >= vertices) throw new GlbError(`index ${values[at]} of ${vertices} vertices`);
    }
    return values;
  }

  private index({ begin, stride, component }: Elements, at: number): number {
    const place = begin + at * stride;
    if (component === 5121) return this.binary.getUint8(place);
    return component === 5123 ? this.binary.getUint16(place, true) : this.binary.getUint32(place, true);
  }

  private rough(material: unknown): Json | undefined {
    return material === undefined ? undefined : (entry(this.document, 'materials', material)['pbrMetallicRoughness'] as Json | undefined);
  }

  private colour(material: unknown): number[] {
    const factor = this.rough(material)?.['baseColorFactor'];
    if (!Array.isArray(factor) || factor.length < 3) return [1, 1, 1];
    return factor.slice(0, 3).map((part) => (typeof part === 'number' && Number.isFinite(part) ? Math.min(1, Math.max(0, part)) : 1));
  }

  // The file of a texture; null: it has none that is known here.
  private picture(texture: Json): Uint8Array | null {
    const source = entry(this.document, 'textures', texture['index'])['source'];
    if (source === undefined) return null;
    const image = entry(this.document, 'images', source);
    if (image['uri'] !== undefined) throw new GlbError(`images[${String(source)}] is another file`);
    let file = this.files.get(image);
    if (!file) {
      const { begin, end } = this.view(image['bufferView']);
      if (end > this.binary.byteLength) throw new GlbError(`images[${String(source)}] ends beyond its buffer`);
      file = new Uint8Array(this.binary.buffer, this.binary.byteOffset + begin, end - begin);
      this.files.set(image, file);
    }
    return file;
  }
}
