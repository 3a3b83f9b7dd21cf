{{- define "fingersplit.name" -}}
{{ .Release.Name | trunc 40 | trimSuffix "-" }}-fingersplit
{{- end }}

{{- define "fingersplit.labels" -}}
app.kubernetes.io/name: fingersplit
app.kubernetes.io/instance: {{ .Release.Name }}
{{- end }}

{{- define "fingersplit.image" -}}
{{ .Values.image.repository }}:{{ .Values.image.tag | default .Chart.AppVersion }}
{{- end }}

{{/* What both kinds of pods have; takes the root context. */}}
{{- define "fingersplit.pod" -}}
automountServiceAccountToken: false
securityContext: {{- toYaml .Values.podSecurityContext | nindent 2 }}
nodeSelector: {{- toYaml .Values.nodeSelector | nindent 2 }}
tolerations: {{- toYaml .Values.tolerations | nindent 2 }}
volumes:
  - name: data
    emptyDir: {sizeLimit: {{ .Values.dataSizeLimit }}}
  - name: kernels
    emptyDir: {}
  - name: tmp
    emptyDir: {}
initContainers:
  # The compiled kernels of the image, where their index can be written.
  - name: kernels
    image: {{ include "fingersplit.image" . }}
    imagePullPolicy: {{ .Values.image.pullPolicy }}
    command: [cp, -r, /var/cache/fingersplit/., /kernels]
    securityContext: {{- include "fingersplit.container" . | nindent 6 }}
    resources:
      requests: {cpu: 100m, memory: 64Mi}
      limits: {memory: 128Mi}
    volumeMounts:
      - {name: kernels, mountPath: /kernels}
{{- end }}

{{- define "fingersplit.container" -}}
allowPrivilegeEscalation: false
readOnlyRootFilesystem: true
capabilities: {drop: [ALL]}
{{- end }}

{{- define "fingersplit.mounts" -}}
- {name: data, mountPath: /data}
- {name: kernels, mountPath: /kernels}
- {name: tmp, mountPath: /tmp}
{{- end }}

{{- define "fingersplit.env" -}}
- {name: FINGERSPLIT_DATABASE_URL, valueFrom: {secretKeyRef: {name: {{ .Values.existingSecret }}, key: {{ .Values.databaseUrlKey }}}}}
- {name: FINGERSPLIT_STORAGE_URL, value: {{ .Values.storageUrl | quote }}}
- {name: FINGERSPLIT_HOST, value: "0.0.0.0"}
- {name: FINGERSPLIT_PORT, value: "8000"}
- {name: FINGERSPLIT_LOG_FORMAT, value: json}
- {name: NUMBA_CACHE_DIR, value: /kernels}
- {name: HOME, value: /tmp}
{{- range $name, $value := .Values.env }}
- {name: {{ $name }}, value: {{ $value | toString | quote }}}
{{- end }}
{{- end }}

{{- define "fingersplit.probes" -}}
startupProbe:
  httpGet: {path: /readyz, port: http}
  periodSeconds: 2
  failureThreshold: 150
readinessProbe:
  httpGet: {path: /readyz, port: http}
  periodSeconds: 2
  timeoutSeconds: 3
  failureThreshold: 2
livenessProbe:
  httpGet: {path: /healthz, port: http}
  periodSeconds: 10
  timeoutSeconds: 5
  failureThreshold: 6
{{- end }}
