// Swagger UI has dark colours for a class of the page; it goes by the system's, also when that changes.

const dark = matchMedia("(prefers-color-scheme: dark)");
const follow = () => {
  document.documentElement.classList.toggle("dark-mode", dark.matches);
  document.documentElement.style.colorScheme = dark.matches ? "dark" : "light";
};
dark.addEventListener("change", follow);
follow();
