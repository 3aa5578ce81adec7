"""The pages and interactive views of a run."""
