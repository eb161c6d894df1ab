"""Answers with an error bar: what is asked, what is known of its error, and what it cost."""
