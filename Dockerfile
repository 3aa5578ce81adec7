# docker build -t bolide .
# docker run --rm -v "$PWD/runs:/runs" bolide run_case valhalla_980km --preset quick --out /runs
FROM python:3.11-slim

# where compiled loops are kept: give it a volume, and later containers begin at once. It is its owner's alone, since what
# lies in it is executed; with --user loops go to the temporary folder, unless BOLIDE_CACHE names another
ENV BOLIDE_CACHE=/cache
RUN mkdir -p /cache /runs && chmod 777 /runs

COPY pyproject.toml README.md LICENSE /src/
COPY cases /src/cases
COPY matter /src/matter
COPY nbody /src/nbody
COPY sph /src/sph
COPY handoff /src/handoff
COPY dem /src/dem
COPY crater /src/crater
COPY pipeline /src/pipeline
COPY bolide /src/bolide
# only wheels: nothing of it needs a compiler, and a build that would is refused
RUN pip install --no-cache-dir hatchling \
 && pip wheel --no-cache-dir --no-deps --no-build-isolation -w /wheels /src \
 && pip install --no-cache-dir --only-binary=:all: "$(ls /wheels/bolide-*.whl)[pictures]" \
 && rm -rf /src /wheels

WORKDIR /runs
CMD ["run_case", "--help"]
