for (const pair of document.querySelectorAll(".pair")) {
  const over = pair.querySelector(".over");
  const slider = pair.querySelector("input");
  const button = pair.querySelector("button");
  let timer = null;
  const show = (percent) => { over.style.clipPath = `inset(0 ${100 - percent}% 0 0)`; };
  slider.addEventListener("input", () => show(slider.value));
  button.addEventListener("click", () => {
    if (timer !== null) {
      clearInterval(timer);
      timer = null;
      button.textContent = "flicker";
      show(slider.value);
      return;
    }
    let actual = true;
    button.textContent = "stop";
    timer = setInterval(() => { actual = !actual; show(actual ? 100 : 0); }, 400);
  });
}
