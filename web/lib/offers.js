// A list of things to do, shown as a select whose first option stands for none of them.

// `take(value)` does one. The keys that move in a shut list only choose, as each step would do something else: then Enter
// does it.
export function watchOffers(select, take) {
  let isMoving = false;
  const done = () => {
    const { value } = select;
    isMoving = false;
    select.value = "";
    if (value) take(value);
  };
  select.addEventListener("pointerdown", () => {
    isMoving = false;
  });
  select.addEventListener("keydown", (event) => {
    const opens = event.key === " " || event.key === "Enter" || event.altKey;
    if (event.key === "Enter" && select.value) {
      event.preventDefault();
      done();
    } else if (event.key !== "Tab") isMoving = !opens;
  });
  select.addEventListener("change", () => {
    if (!isMoving) done();
  });
  select.addEventListener("blur", () => {
    select.value = "";
  });
}
