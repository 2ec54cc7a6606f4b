// Light or dark: as the system says, until the reader chooses.

const theme = {
  changed: () => {},
  isDark: () => {
    const chosen = document.documentElement.dataset.theme;
    return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  },
};

(() => {
  const root = document.documentElement;
  const key = "macropulse-theme";
  // A page opened from disk may have no memory; then the choice lasts as long as the page.
  const remember = (act) => {
    try {
      return act(window.localStorage);
    } catch {
      return null;
    }
  };
  const chosen = remember((memory) => memory.getItem(key));
  if (chosen === "light" || chosen === "dark") root.dataset.theme = chosen;
  for (const button of document.querySelectorAll("[data-theme-switch]")) {
    const label = () => {
      button.textContent = theme.isDark() ? "Light" : "Dark";
      button.setAttribute("aria-label", `Switch to the ${button.textContent.toLowerCase()} page`);
    };
    button.hidden = false;
    label();
    button.addEventListener("click", () => {
      root.dataset.theme = theme.isDark() ? "light" : "dark";
      remember((memory) => memory.setItem(key, root.dataset.theme));
      label();
      theme.changed();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      label();
      theme.changed();
    });
  }
})();
