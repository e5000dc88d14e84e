// How large a PNG or JPEG file is, by its head, so that nothing is decoded that would not be drawn. Pure: bytes in, a size
// or null out.

export interface PictureSize {
  type: 'image/png' | 'image/jpeg';
  width: number;
  height: number;
}

const PNG = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];

// Null: it is neither, or is cut short before its size.
export function pictureSize(file: Uint8Array): PictureSize | null {
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  if (file.length >= 24 && PNG.every((byte, at) => file[at] === byte)) {
    return { type: 'image/png', width: view.getUint32(16), height: view.getUint32(20) };
  }
  return file.length >= 4 && view.getUint16(0) === 0xffd8 ? jpegSize(view) : null;
}

// Segments follow each other, each with its length, up to the frame's.
function jpegSize(view: DataView): PictureSize | null {
  for (let at = 2; at + 9 <= view.byteLength && view.getUint8(at) === 0xff; ) {
    const kind = view.getUint8(at + 1);
    if (kind === 0xff) {
      ++at; // it is filled up
      continue;
    }
    // Frames but for those numbers, which are tables (ITU T.81, table B.1).
    const frame = kind >= 0xc0 && kind <= 0xcf && kind !== 0xc4 && kind !== 0xc8 && kind !== 0xcc;
    if (frame) return { type: 'image/jpeg', width: view.getUint16(at + 7), height: view.getUint16(at + 5) };
    at += 2 + view.getUint16(at + 2);
  }
  return null;
}
