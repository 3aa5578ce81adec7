"""What Winter 2017 (MSc thesis, University of Vienna) prints on encounters, and how a census compares with it."""
