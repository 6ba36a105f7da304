"""Mutations: correct specs with one known defect each, and what the checker makes of them."""
