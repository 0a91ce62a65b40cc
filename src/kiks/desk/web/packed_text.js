/* How pages carry large data (see kiks/export/packed_text.py). */

const LENGTH_BYTES = 4;

/** Unpack a text: {head, rest}, what its JSON says and the bytes behind it. */
export async function unpackText(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const end = LENGTH_BYTES + new DataView(bytes.buffer).getUint32(0, true);
  return { head: JSON.parse(new TextDecoder().decode(bytes.subarray(LENGTH_BYTES, end))), rest: bytes.subarray(end) };
}
