FROM python:3.11-slim-bookworm

# OSMesa draws pictures without a display or a GPU; pinocchio's wheel expects the system's OpenMP runtime.
RUN apt-get update \
 && apt-get install --yes --no-install-recommends libgomp1 libosmesa6 \
 && rm -rf /var/lib/apt/lists/*

# `train,cluster` brings Ray, too.
ARG EXTRAS=train
WORKDIR /iowbc
COPY pyproject.toml constraints.txt ./
# The heavy packages are a layer of their own, made again only when the versions change.
RUN python3 -m venv /opt/venv \
 && /opt/venv/bin/pip install --no-cache-dir --disable-pip-version-check --constraint constraints.txt torch==2.13.0 \
 && mkdir iowbc recipes robots && touch iowbc/__init__.py README.md LICENSE NOTICE \
 && /opt/venv/bin/pip install --no-cache-dir --disable-pip-version-check --constraint constraints.txt --editable ".[${EXTRAS}]"
COPY README.md LICENSE NOTICE ./
COPY iowbc iowbc
COPY robots robots
COPY recipes recipes

RUN useradd --create-home --uid 1000 iowbc && mkdir -p runs && chown iowbc:iowbc runs
USER iowbc
ENV PATH=/opt/venv/bin:$PATH MUJOCO_GL=osmesa MLFLOW_DISABLE_TELEMETRY=true
VOLUME ["/iowbc/runs"]
ENTRYPOINT ["iowbc"]
CMD ["--help"]
