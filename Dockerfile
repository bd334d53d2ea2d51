# Two stages: pip and the sources stay behind, the image holds the installed package alone.

# A tag and no digest: a rebuild gets the fixes of the system below.
FROM python:3.11-slim AS build
WORKDIR /source
COPY . .
RUN python -m venv /opt/penumbra \
 && /opt/penumbra/bin/pip install --no-cache-dir --constraint constraints.txt '.[server,mesh,exr,study,postgres,dask,s3,traces]'

FROM python:3.11-slim
LABEL org.opencontainers.image.title="Penumbra" \
      org.opencontainers.image.description="A render service for ray-traced scenes" \
      org.opencontainers.image.licenses="MIT"
COPY --from=build /opt/penumbra /opt/penumbra
RUN useradd --system --uid 10001 --create-home --home-dir /var/lib/penumbra penumbra \
 && install -d -o penumbra -g penumbra /var/lib/penumbra/data
ENV PATH=/opt/penumbra/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PENUMBRA_DATA=/var/lib/penumbra/data
# A number: Kubernetes cannot know from a name that it is not root.
USER 10001
WORKDIR /var/lib/penumbra
VOLUME /var/lib/penumbra/data
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
  CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/readyz', timeout=2)"]
CMD ["penumbra", "serve", "--host", "0.0.0.0", "--port", "8000"]
