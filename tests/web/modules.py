"""Functions of the editor's modules, called by themselves in a page."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Page


def call(page: Page, module: str, function: str, *arguments: Any) -> Any:
    script = """async ([module, name, args]) => {
        const all = await import(new URL(module, location));
        const result = all[name](...args);
        return result === undefined ? "undefined" : result;
    }"""
    return page.evaluate(script, [module, function, list(arguments)])
