"""The claims of Winter 2017 on Valhalla, beside what is found here."""
