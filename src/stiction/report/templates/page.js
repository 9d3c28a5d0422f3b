document.querySelectorAll(".zoom").forEach((link) => {
  link.addEventListener("click", (event) => {
    event.preventDefault();
    link.classList.toggle("large");
  });
});
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    document.querySelectorAll(".zoom.large").forEach((link) => link.classList.remove("large"));
  }
});
const buttons = document.querySelectorAll(".filter button");
buttons.forEach((button) => {
  button.addEventListener("click", () => {
    buttons.forEach((other) => other.setAttribute("aria-pressed", String(other === button)));
    document.querySelectorAll(".claims").forEach((table) => {
      let shown = 0;
      table.querySelectorAll("tbody tr").forEach((row) => {
        row.hidden = Boolean(button.dataset.show) && !row.classList.contains(button.dataset.show);
        shown += row.hidden ? 0 : 1;
      });
      table.hidden = shown === 0;
      table.previousElementSibling.hidden = shown === 0;
    });
  });
});
