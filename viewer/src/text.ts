/// Bytes as text inside of a page: mirrorbake/viewer/text.py writes it.

/// Characters that such a text has none of; those from 128 on stand for one of them and the seven bits behind it.
const FORBIDDEN = [...'\0\n\r"<\\'].map((character) => character.charCodeAt(0));

export function bytesOfText(text: string, count: number): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(count);
  let at = 0;
  let bits = 0;
  let held = 0;
  const take = (group: number) => {
    bits = ((bits << 7) | group) & 0x7fff;
    held += 7;
    if (held < 8) return;
    held -= 8;
    bytes[at++] = bits >> held;
  };
  for (let i = 0; i < text.length; ++i) {
    const code = text.charCodeAt(i);
    if (code >= 128) take(FORBIDDEN[(code >> 7) - 1]);
    take(code & 127);
  }
  return bytes;
}
