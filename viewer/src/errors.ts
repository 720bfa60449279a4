/// Something that the person in front of the page should read.
export class UserError extends Error {
  constructor(
    readonly kind: "webgl" | "texture" | "codec" | "missing" | "damaged" | "version" | "headset",
    message: string,
  ) {
    super(message);
  }
}
