import { expect, test } from "vitest";
import { bytesOfText } from "../../src/text";

// What text_of_bytes in mirrorbake/viewer/text.py makes of these bytes; its own test has the same table.
const TEXTS: [number[], string][] = [
  [[], ""],
  [[0xff, 0xff], "\x7f\x7f`"],
  [[0, 0, 0], "\x80\x80"],
  [[0x14, 0x28, 0x50, 0xa1, 0x42], "\u010a\u010a\u0108"],
  [[0x78, 0xf1, 0xe3, 0xc7, 0x8f, 0x1e, 0x3c], "\u02bc\u02bc\u02bc\u02bc"],
  [[0x22, 0x3c, 0x5c, 0x0d, 0x0a, 0x00, 0xe2, 0x80, 0xa8], "\x11\x0f\x0b@h(\x01b@*\x80"],
];

test("bytes come back out of the text that a page holds", () => {
  for (const [bytes, text] of TEXTS) expect([...bytesOfText(text, bytes.length)]).toEqual(bytes);
});
