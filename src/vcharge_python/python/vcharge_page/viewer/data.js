// Reads the description and the blocks of bytes that are in the page.

export function readDescription() {
  return JSON.parse(document.getElementById("scene").textContent);
}

/** The bytes of a base64 text. */
export function bytesOf(text) {
  if (Uint8Array.fromBase64) {
    return Uint8Array.fromBase64(text);
  }
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) {
    bytes[i] = letters.charCodeAt(i);
  }
  return bytes;
}

/** The bytes of a block, whose text leaves the page. */
export function takeBlock(name) {
  const element = document.getElementById(`block-${name}`);
  const bytes = bytesOf(element.textContent);
  element.remove();
  return bytes;
}

/** The address of a JPEG file that lies in a block. `offset` is a multiple of three. */
export function pictureAddress(name, offset = 0, size = undefined) {
  const text = document.getElementById(`block-${name}`).textContent;
  const end = size === undefined ? text.length : (offset + Math.ceil(size / 3) * 3) / 3 * 4;
  return "data:image/jpeg;base64," + text.slice(offset / 3 * 4, end);
}
