// The slider over each pair of pictures, and the buttons that choose what is compared.
for (const place of document.querySelectorAll(".place")) {
  const compare = place.querySelector(".compare");
  const slide = place.querySelector(".slide");
  const over = compare.querySelector(".over");
  const tag = compare.querySelector(".left");
  const put = (share) => {
    slide.value = share;
    compare.style.setProperty("--at", `${share}%`);
  };
  slide.addEventListener("input", () => put(slide.value));
  const follow = (event) => {
    const box = compare.getBoundingClientRect();
    put(Math.min(100, Math.max(0, (100 * (event.clientX - box.left)) / box.width)));
  };
  compare.addEventListener("pointerdown", (event) => {
    compare.setPointerCapture(event.pointerId);
    follow(event);
  });
  compare.addEventListener("pointermove", (event) => {
    if (event.pointerType === "mouse" || event.buttons) follow(event);
  });
  const buttons = place.querySelectorAll(".pick button");
  for (const button of buttons) {
    button.addEventListener("click", () => {
      for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
      const picture = place.querySelector(`img[data-name="${button.dataset.name}"]`);
      over.src = picture.src;
      over.alt = picture.alt;
      tag.textContent = button.textContent;
    });
  }
}
