// Reads the meshes of a binary glTF 2.0 file (.glb): positions, normals, triangles and one colour for each primitive.
// Pure: bytes in, meshes or a GlbError out. Everything lies in the file itself, and whatever names another is refused, so
// that no file makes the page ask another host.

export class GlbError extends Error {}

export interface Primitive {
  positions: Float32Array;
  normals: Float32Array | null; // null: there are none
  indices: Uint32Array; // three a triangle
  colour: number[]; // red, green and blue, linear, 0 to 1
}

export const MOST_BYTES = 64 << 20;
export const MOST_TRIANGLES = 1_000_000; // in a file

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
const TRIANGLES = 4;
const FLOAT = 5126;
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

interface Elements {
  begin: number; // in the buffer
  stride: number;
  count: number;
  component: number;
}

class File {
  private triangles = 0;

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
    const positions = this.vectors(attributes['POSITION']);
    const indices = this.indices(primitive['indices'], positions.length / 3);
    const normals = attributes['NORMAL'] === undefined ? null : this.vectors(attributes['NORMAL']);
    if (normals && normals.length !== positions.length) throw new GlbError('has not as many normals as positions');
    return { positions, normals, indices, colour: this.colour(primitive['material']) };
  }

  private elements(index: unknown, type: string, components: (component: number) => number): Elements {
    const accessor = entry(this.document, 'accessors', index);
    if (accessor['sparse'] !== undefined) throw new GlbError('is sparse');
    const component = whole(accessor, 'componentType');
    const size = components(component);
    if (accessor['type'] !== type || size === 0) throw new GlbError(`accessors[${String(index)}] has another type`);
    const view = entry(this.document, 'bufferViews', accessor['bufferView']);
    const buffer = entry(this.document, 'buffers', view['buffer']);
    if (view['buffer'] !== 0 || buffer['uri'] !== undefined) throw new GlbError('its buffer is another file');
    const count = whole(accessor, 'count');
    const stride = whole(view, 'byteStride', 0) || size;
    const offset = whole(accessor, 'byteOffset', 0);
    const begin = whole(view, 'byteOffset', 0) + offset;
    const end = whole(view, 'byteOffset', 0) + whole(view, 'byteLength');
    const fits = end <= this.binary.byteLength && stride >= size && stride <= 255;
    if (!fits || (count > 0 && begin + (count - 1) * stride + size > end)) throw new GlbError(`accessors[${String(index)}] ends beyond its buffer`);
    return { begin, stride, count, component };
  }

  private vectors(index: unknown): Float32Array {
    const { begin, stride, count } = this.elements(index, 'VEC3', (component) => (component === FLOAT ? 12 : 0));
    const values = new Float32Array(3 * count);
    for (let at = 0; at < count; ++at) {
      for (let axis = 0; axis < 3; ++axis) {
        const value = this.binary.getFloat32(begin + at * stride + 4 * axis, true);
        if (!Number.isFinite(value)) throw new GlbError(`accessors[${String(index)}] has a number that is not finite`);
        values[3 * at + axis] = value;
      }
    }
    return values;
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

  private colour(material: unknown): number[] {
    if (material === undefined) return [1, 1, 1];
    const rough = entry(this.document, 'materials', material)['pbrMetallicRoughness'] as Json | undefined;
    const factor = rough?.['baseColorFactor'];
    if (!Array.isArray(factor) || factor.length < 3) return [1, 1, 1];
    return factor.slice(0, 3).map((part) => (typeof part === 'number' && Number.isFinite(part) ? Math.min(1, Math.max(0, part)) : 1));
  }
}
