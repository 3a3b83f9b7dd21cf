# The service, with its kernels compiled. Without API keys it listens on loopback inside the container only:
#   docker build -t fingersplit .
#   docker run --rm -v fingersplit:/data fingersplit fingersplit keys create robot-7
#   docker run --rm -p 8000:8000 -v fingersplit:/data -e FINGERSPLIT_HOST=0.0.0.0 fingersplit
# Several machines: compose.yaml, deploy/helm/fingersplit.

FROM python:3.11-slim AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
RUN python -m venv /opt/fingersplit
ENV PATH=/opt/fingersplit/bin:$PATH
COPY requirements/run.lock /src/requirements/run.lock
RUN pip install --require-hashes -r /src/requirements/run.lock
COPY core /src/core
COPY clients /src/clients
COPY service /src/service
RUN pip install --no-deps --no-build-isolation /src/core /src/clients/python /src/service

FROM python:3.11-slim
ENV PATH=/opt/fingersplit/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    MUJOCO_GL=disable \
    NUMBA_CACHE_DIR=/var/cache/fingersplit \
    FINGERSPLIT_VIEWER_DIR=/var/cache/fingersplit \
    FINGERSPLIT_DATA_DIR=/data
RUN useradd --uid 10001 --create-home fingersplit \
    && mkdir -p /data "$NUMBA_CACHE_DIR" \
    && chown fingersplit /data "$NUMBA_CACHE_DIR"
COPY --from=build /opt/fingersplit /opt/fingersplit
USER 10001
# Compiled for the CPU of the machine that builds; on another kind of CPU the first start compiles again.
RUN fingersplit warm && fingersplit setup-viewer
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=120s CMD ["python", "-c", "\
import os, urllib.request as r; r.urlopen('http://127.0.0.1:' + os.environ.get('FINGERSPLIT_PORT', '8000') + '/readyz')"]
CMD ["fingersplit", "serve"]
