// Pictures that meshes are painted with: looked at before they are decoded, in layers of one texture, and bounded.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { pictureSize } from '../src/protocol/picture.ts';
import { LAYERLESS, LAYER_PIXELS, MOST_LAYERS, Pictures } from '../src/view/pictures.ts';
import { makePng } from '../testing/glb_file.ts';

const grey = () => [128, 128, 128];
const jpeg = (width: number, height: number) => Buffer.from([0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xff, 0xc2, 0, 11, 8, height >> 8, height & 255, width >> 8, width & 255, 1, 0, 0, 0]);

test('the size of a picture is read by its head, and of nothing else', () => {
  assert.deepEqual(pictureSize(makePng(3, 2, grey)), { type: 'image/png', width: 3, height: 2 });
  assert.deepEqual(pictureSize(jpeg(640, 300)), { type: 'image/jpeg', width: 640, height: 300 });
  const png = makePng(3, 2, grey);
  for (let size = 0; size < 24; ++size) assert.equal(pictureSize(png.subarray(0, size)), null, `${size} bytes`);
  const cut = jpeg(640, 300);
  for (let size = 0; size < 18; ++size) assert.equal(pictureSize(cut.subarray(0, size)), null, `${size} bytes`);
  assert.equal(pictureSize(Buffer.from('GIF89a..........................')), null);
});

const shade = (value: number) => new Uint8ClampedArray(4 * LAYER_PIXELS * LAYER_PIXELS).fill(value);

test('each picture has a layer of one texture, which grows', async () => {
  let decoded = 0;
  const pictures = new Pictures(async (file) => {
    ++decoded;
    return shade(file[16 + 3]!); // its width
  });
  const { uniform } = pictures;
  const files = [1, 2, 3].map((width) => makePng(width, 1, grey));
  const layers = await Promise.all([...files, files[0]!].map((file) => pictures.layerOf(file)));
  assert.deepEqual(layers, [0, 1, 2, 0]);
  assert.equal(decoded, 3);
  const { image } = uniform.value;
  assert.deepEqual([image.width, image.height, image.depth], [LAYER_PIXELS, LAYER_PIXELS, 4]);
  const data = image.data as Uint8Array;
  const size = 4 * LAYER_PIXELS * LAYER_PIXELS;
  assert.deepEqual([0, size - 1, size, 2 * size, 3 * size].map((at) => data[at]), [1, 1, 2, 3, 0]);
  pictures.clear();
  assert.equal(uniform.value.image.depth, 1);
  assert.equal(await pictures.layerOf(files[2]!), 0, 'another world begins anew');
});

test('pictures that are too large, too many, damaged or none are refused in a line', async () => {
  let decoded = 0;
  const pictures = new Pictures(async () => {
    if (++decoded === 1) throw new Error('no');
    return shade(0);
  });
  const fault = (file: Uint8Array) => pictures.layerOf(file).then(() => '', (error: Error) => error.message);
  assert.equal(await fault(makePng(2, 2, grey)), 'it is damaged');
  assert.equal(await fault(Buffer.from('no picture')), 'it is no PNG or JPEG file');
  assert.equal(await fault(jpeg(5000, 16)), 'it has 5000 x 16 pixels, more than 4096 along one side');
  assert.equal(decoded, 1, 'what is too large is not decoded');
  for (let at = 3; at < MOST_LAYERS; ++at) assert.equal(await fault(makePng(1, 1, grey)), '');
  assert.equal(await fault(makePng(1, 1, grey)), `${MOST_LAYERS} others are drawn, which are the most`);
});

test('what is decoded for a world that is gone takes no layer', async () => {
  let give!: () => void;
  const pictures = new Pictures(() => new Promise((done) => (give = () => done(shade(9)))));
  const late = pictures.layerOf(makePng(1, 1, grey));
  pictures.clear();
  give();
  assert.equal(await late, LAYERLESS);
  assert.equal(pictures.uniform.value.image.depth, 1);
});
