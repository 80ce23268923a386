"""The words of a report as Markdown: what its last section explains."""


def words() -> str:
    """A heading for each."""
    from reports.sections.definitions import TERMS

    return "\n".join(f"### {term}\n\n{meaning}\n" for term, meaning in TERMS.items())
