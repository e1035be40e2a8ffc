"""The bar of `progress=True`."""

from __future__ import annotations

from typing import Any

from .errors import ArgumentError


class Bar:
    """Shows the fraction that is done, by tqdm."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,import-not-found,unused-ignore]
        except ImportError:
            raise ArgumentError("progress=True shows a bar by tqdm, which is not installed; pip install tqdm, or give a function") from None
        self._bar: Any = tqdm(total=1.0, bar_format="{desc}{percentage:3.0f}% {bar} {elapsed}<{remaining}")

    def __call__(self, progress: Any) -> None:
        self.show(float(getattr(progress, "fraction", progress)), getattr(progress, "pass_name", ""))

    def show(self, fraction: float, text: str) -> None:
        self._bar.set_description_str(text, refresh=False)
        self._bar.update(max(fraction - self._bar.n, 0.0))

    def close(self, is_done: bool) -> None:
        """Ends the bar, at 100 % if all is done."""
        if is_done:
            self._bar.set_description_str("", refresh=False)
            self._bar.update(self._bar.total - self._bar.n)
        self._bar.close()
