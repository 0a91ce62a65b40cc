# A desk for a class on a server: docker build -t kiks . && docker run --rm -p 8123:8123 -v "$PWD":/work kiks
# The printed address has a token; put a proxy with TLS in front of it where the network is not yours alone.
FROM python:3.13-slim-bookworm

COPY . /src
RUN pip install --no-cache-dir /src && rm -r /src && useradd --create-home student && mkdir /work && chown student /work

USER 1000
WORKDIR /work
RUN kiks warmup

EXPOSE 8123
ENTRYPOINT ["kiks"]
CMD ["desk", "--host", "0.0.0.0", "--folder", "/work", "--no-browser"]
